"""The client side: requests from commands to running systems and to any ROS graph."""
