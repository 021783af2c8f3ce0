"""What channels observe: the ROS graph, topics, the log, reports of systems, and diagrams."""
