"""The nodes of a system that run Python: behaviors and rclpy classes, and what they create."""
