"""Nodes outside the process: child processes and external nodes, and how they are driven."""
