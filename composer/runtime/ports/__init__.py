"""The ports of a running node, one kind per file. The node's lifecycle state gates all of them."""
