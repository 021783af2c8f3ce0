"""Checks of the ROS 2 setup of a computer, each with a remedy.

Only ``graph`` imports rclpy. The other checks also work without it.
"""
