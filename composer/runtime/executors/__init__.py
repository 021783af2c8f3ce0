"""Event loops: one scheduler for executors of all kinds, on one thread or on several."""
