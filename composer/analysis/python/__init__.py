"""The Python files of behaviors and classes, read as syntax and never imported."""
