"""Message classes, QoS profiles, the services that every node has, and the graph, in rclpy."""
