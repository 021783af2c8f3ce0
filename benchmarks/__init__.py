"""Benchmarks of the composer against alternatives: ``make bench``."""
