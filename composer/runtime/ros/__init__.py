"""Message classes, QoS profiles and graph endpoints, as rclpy has them."""
