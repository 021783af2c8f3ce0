"""Quality of service."""
