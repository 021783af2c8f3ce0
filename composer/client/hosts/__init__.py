"""Processes of a system on other computers: compared, started and ended by ssh; files copied."""
