from typing import Literal

from rclpy.exceptions import InvalidServiceNameException as InvalidServiceNameException
from rclpy.exceptions import InvalidTopicNameException as InvalidTopicNameException

TOPIC_SEPARATOR_STRING: str

def validate_topic_name(name: str, *, is_service: bool = False) -> Literal[True]: ...
