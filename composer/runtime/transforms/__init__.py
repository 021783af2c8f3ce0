"""Frames of tf2: the transforms that a process has received, and what nodes do with them."""
