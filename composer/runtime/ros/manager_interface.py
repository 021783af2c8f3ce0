"""How documents of the protocol are carried by ROS: profiles of topics, and one service type.

A document is a text, and so is the answer. Of the service types in every ROS installation,
SetParametersAtomically is the one that takes any text and returns another, with a reason if there
is none; a type of our own would have to be compiled by every user. Its only parameter is
``request``.
"""

from __future__ import annotations

from typing import Any

from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue, SetParametersResult
from rcl_interfaces.srv import SetParametersAtomically as RequestService
from rclpy.qos import DurabilityPolicy, QoSProfile

from composer.runtime.protocol.codec import ProtocolError, decode, encode
from composer.runtime.ros.limited_requests import MAX_ITEMS, TooLarge

__all__ = ["RequestService"]

#: Transient local: a late joiner gets the last message at once.
STATE_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
CALLBACKS_QOS = QoSProfile(depth=10)

_PARAMETER = "request"


def request_message(request: Any) -> RequestService.Request:
    """Return the message with a request of :mod:`composer.runtime.protocol.requests`."""
    kind = ParameterType.PARAMETER_STRING
    value = ParameterValue(type=kind, string_value=encode(request))
    return RequestService.Request(parameters=[Parameter(name=_PARAMETER, value=value)])


def read_request(message: Any, *kinds: type[Any]) -> Any:
    """Return the request of one of the types ``kinds`` in a message. Raises ProtocolError."""
    if isinstance(message, TooLarge):
        raise ProtocolError(message.reason)
    texts = [item.value.string_value for item in message.parameters if item.name == _PARAMETER]
    if len(texts) != 1:
        raise ProtocolError(f"expected one parameter '{_PARAMETER}' with a document as its value")
    return decode(texts[0], *kinds, limit=MAX_ITEMS)


def answer_message(answer: Any) -> RequestService.Response:
    """Return the message with an answer; with the reason for a ProtocolError."""
    is_error = isinstance(answer, ProtocolError)
    reason = str(answer) if is_error else encode(answer)
    return RequestService.Response(
        result=SetParametersResult(successful=not is_error, reason=reason)
    )


def read_answer(message: RequestService.Response, request: Any) -> Any:
    """Return the answer to a request in a message. Raises ProtocolError."""
    if not message.result.successful:
        raise ProtocolError(message.result.reason)
    return decode(message.result.reason, request.Answer)
