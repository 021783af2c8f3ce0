"""The types of what others define: the API for behaviors, rclpy, numpy, the standard library."""
