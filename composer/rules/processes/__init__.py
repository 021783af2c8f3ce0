"""Processes of a system, the computers they run on, and how they discover each other."""
