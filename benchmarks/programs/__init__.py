"""The measured programs; each one runs in a separate process."""
