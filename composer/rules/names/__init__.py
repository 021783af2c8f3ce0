"""Names that are invalid in ROS, that collide, or that surprise."""
