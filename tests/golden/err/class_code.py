from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Trigger


class Lidar(Node):
    def __init__(self):
        super().__init__("lidar")
        self.declare_parameter("rate_hz", 10.0)
        self.rate = self.get_parameter("rate").value
        self.scans = self.create_publisher(LaserScan, "scan")
        self.create_service(Trigger, "~/start", self.start)
        self.create_subscription(LaserScan, "raw", self.on_scan, 10)

    def start(self, request):
        return Trigger.Response()

    def on_scan(self, message):
        message.angle_min = message.header.stamp


class Mast(LifecycleNode):
    def __init__(self):
        self.height = 0.0

    def on_configure(self, state):
        return True
