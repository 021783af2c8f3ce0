"""The Python code of behaviors: syntax, imports, names and types."""
