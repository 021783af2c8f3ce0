from rclpy.node import Node
from sensor_msgs.msg import LaserScan


class Lidar(Node):
    def __init__(self):
        super().__init__("lidar")
        self.declare_parameter("rate_hz", 10.0)
        self.declare_parameter("frame_id", "laser")
        self.scan = self.create_publisher(LaserScan, "scan", 10)
