"""Writes what other tools need to run a system: pure functions of the model."""
