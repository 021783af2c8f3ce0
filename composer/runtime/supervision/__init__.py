"""Bring-up, supervision and tear-down of a system, on the main thread."""
