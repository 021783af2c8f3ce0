"""Nodes outside the process: external nodes and executables, and the clients of their lifecycle."""
