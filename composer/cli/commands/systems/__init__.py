"""Commands that run systems, and those for running systems."""
