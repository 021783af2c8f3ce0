"""The time of a node: system time, steady time, or simulated time from /clock."""
