"""Where the nodes of a system run, and how they discover each other."""
