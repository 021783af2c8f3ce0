from rclpy.node import Node


class Talker(Node):
    def __init__(self):
        super().__init__("talker")


class Helper:
    pass
