"""The clock: whatever reads or waits for time in a running system asks it."""
