"""Nodes that are programs of their own: executables, and what they cannot do."""
