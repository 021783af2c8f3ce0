from rclpy.node import Node

class LoggingService:
    def __init__(self, node: Node) -> None: ...
