"""Commands for the files of systems, node types and projects."""
