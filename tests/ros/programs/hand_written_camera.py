"""A plain rclpy node that publishes images: /camera (rgb8, 640 x 480) at 30 Hz.

It also publishes a simulated time on /clock, which begins at 1000 s, once a latched /map, and for
subscriptions 120 MB per second on /large, in messages of 1 MB.

Prints ``ready`` at the start.
"""

from __future__ import annotations

from array import array

import rclpy
from nav_msgs.msg import OccupancyGrid
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import UInt8MultiArray

from tests.ros.programs.spinning import spin

WIDTH, HEIGHT = 640, 480
#: The smallest valid PNG: one transparent pixel.
PNG = bytes.fromhex(
    "89504e470d0a1a0a0000000d49484452000000010000000108060000001f15c489"
    "0000000a49444154789c63000100000500010d0a2db40000000049454e44ae426082"
)


class Camera(Node):
    def __init__(self) -> None:
        super().__init__("camera")
        self.images = self.create_publisher(Image, "camera", qos_profile_sensor_data)
        self.compressed = self.create_publisher(
            CompressedImage, "camera/compressed", qos_profile_sensor_data
        )
        self.image = Image(width=WIDTH, height=HEIGHT, encoding="rgb8", step=WIDTH * 3)
        self.image.data = array("B", bytes((10, 20, 30)) * (WIDTH * HEIGHT))
        kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.maps = self.create_publisher(OccupancyGrid, "/map", kept)
        self.maps.publish(OccupancyGrid(data=[0, 100, -1]))
        self.large = self.create_publisher(UInt8MultiArray, "/large", 10)
        self.content = UInt8MultiArray(data=array("B", bytes(1_000_000)))
        self.clocks = self.create_publisher(Clock, "/clock", 10)
        self.time = Clock()
        self.time.clock.sec = 1000
        self.create_timer(1 / 30, self.tick)

    def tick(self) -> None:
        self.time.clock.sec += 1
        self.clocks.publish(self.time)
        self.images.publish(self.image)
        for _ in range(4 if self.large.get_subscription_count() else 0):
            self.large.publish(self.content)
        self.compressed.publish(CompressedImage(format="png", data=PNG))


if __name__ == "__main__":
    rclpy.init()
    spin(Camera())
