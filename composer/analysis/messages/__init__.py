"""The messages that expressions read and reactions fill."""
