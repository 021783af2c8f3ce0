"""What a process makes of its middleware before ROS starts: environment, discovery, Fast DDS."""
