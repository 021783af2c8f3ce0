"""Runs scenarios: what happens to a system in one run, and what the system must do."""
