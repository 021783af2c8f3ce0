from rclpy.node import Node

class ParameterService:
    def __init__(self, node: Node) -> None: ...
