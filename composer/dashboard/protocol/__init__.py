"""What a browser and the dashboard send to each other: requests, errors, and updates that wait."""
