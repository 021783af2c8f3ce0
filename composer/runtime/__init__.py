"""The running system. The only part of the composer that imports rclpy."""
