"""What concerns the whole process: environment, DDS profiles, instance lock, signals, exit."""
