"""Commands for the ROS graph, for interfaces and for the setup of ROS 2."""
