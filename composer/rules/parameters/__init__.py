"""Types, ranges and declarations of parameters."""
