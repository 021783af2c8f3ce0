from typing import Any, TypeVar

from rclpy.lifecycle.managed_entity import SimpleManagedEntity as SimpleManagedEntity
from rclpy.publisher import Publisher as Publisher

_T = TypeVar("_T")

MsgType = TypeVar("MsgType")

class LifecyclePublisher(SimpleManagedEntity, Publisher[_T]):
    def __init__(self, *args: Any, **kwargs: Any) -> None: ...
