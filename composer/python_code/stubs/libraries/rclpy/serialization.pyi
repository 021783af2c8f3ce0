from typing import TypeVar

from _ros import MessageType
from rclpy.type_support import check_for_type_support as check_for_type_support

_T = TypeVar("_T")

def serialize_message(message: MessageType) -> bytes: ...
def deserialize_message(serialized_message: bytes, message_type: type[_T]) -> _T: ...
