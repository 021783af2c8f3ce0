"""Periods, latencies, and the load of executors."""
