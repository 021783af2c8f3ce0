"""Ports without a counterpart, and counterparts that disturb each other."""
