"""The ports of a running node, one kind a file. All are gated by the node's lifecycle state."""
