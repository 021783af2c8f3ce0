"""Message classes, QoS profiles, and the services that every node has, as rclpy has them."""
