"""Calls: their arguments, and what functions, rclpy and the standard library do with them."""
