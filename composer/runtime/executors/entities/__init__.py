"""Sources: watch, take from and dispatch each kind of ROS entity, with rcl and rclpy internals."""
