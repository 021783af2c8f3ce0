"""Scenes: what a diagram is about, from declared systems or from a running ROS graph."""
