"""References to nodes, ports, types and profiles that do not exist, or are of the wrong kind."""
