"""The Python code of behaviors and classes: syntax, imports, names and types."""
