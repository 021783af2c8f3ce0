"""Values that are stored in messages and sent."""
