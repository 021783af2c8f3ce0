from typing import Literal

from rclpy.exceptions import InvalidNamespaceException as InvalidNamespaceException

def validate_namespace(namespace: str) -> Literal[True]: ...
