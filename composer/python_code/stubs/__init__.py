"""Type stubs for editors and type checkers: messages, node types, and rclpy.

A stub is text by its path, such as ``geometry_msgs/msg.pyi``. ROS is not needed, because the types
come from the definitions that the composer reads itself.
"""
