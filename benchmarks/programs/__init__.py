"""What is measured, each run as a process of its own."""
