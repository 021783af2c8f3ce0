"""Declare, prove and run a ROS 2 system: YAML in, real lifecycle nodes out, in one process."""
