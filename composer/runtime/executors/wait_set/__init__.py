"""The loops of the ``single_threaded`` and ``multi_threaded`` executors, on rclpy's wait sets."""
