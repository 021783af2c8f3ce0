"""What channels observe: the ROS graph, reports of systems, topics, the log and processes."""
