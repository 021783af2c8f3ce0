"""The nodes of a system: their node types, and what the system adds to these."""
