"""What a node or a node type declares: its ports, parameters, reactions, transforms and code."""
