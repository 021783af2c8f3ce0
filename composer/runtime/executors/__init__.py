"""Event loops: the composer's own scheduler and rclpy's executors behind one interface."""
