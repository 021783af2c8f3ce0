"""What commands share: options, arguments, ROS sessions, output and errors."""
