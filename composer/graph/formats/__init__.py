"""One format of diagrams, one module."""
