from typing import Literal

from rclpy.exceptions import InvalidParameterException as InvalidParameterException

def validate_parameter_name(name: str) -> Literal[True]: ...
