"""Hosted rclpy classes."""
