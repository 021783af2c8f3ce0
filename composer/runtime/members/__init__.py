"""Other processes of the system: their reports, requests to them, and the nodes in them."""
