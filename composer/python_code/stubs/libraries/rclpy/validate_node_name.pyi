from typing import Literal

from rclpy.exceptions import InvalidNodeNameException as InvalidNodeNameException

def validate_node_name(node_name: str) -> Literal[True]: ...
