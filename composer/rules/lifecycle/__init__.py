"""Dependencies between nodes, and what happens when a node fails."""
