"""The commands, one per file, in the groups of the help."""
