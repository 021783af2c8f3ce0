"""Messages of the protocol as bytes and JSON, without ROS. All numbers are little-endian."""

from __future__ import annotations

import struct
from typing import Any

from composer.base.fast_dataclass import dataclass
from composer.dashboard.protocol.messages import (
    BadRequestError,
    Values,
    check_characters,
    parse_object,
)

#: The names of the protocol, the one that is preferred first.
SUBPROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
CDR, SCHEMA_ENCODING = "cdr", "ros2msg"
INFO, WARNING, ERROR = 0, 1, 2

_MESSAGE_DATA, _TIME, _SERVICE_RESPONSE = 1, 2, 3
_CLIENT_MESSAGE, _SERVICE_REQUEST = 1, 2
_MESSAGE_HEAD = struct.Struct("<BIQ")
_TIME_FRAME = struct.Struct("<BQ")
_CLIENT_HEAD = struct.Struct("<BI")
_SERVICE_HEAD = struct.Struct("<BIII")
_MAX_NUMBER = 2**32 - 1


@dataclass(frozen=True, slots=True)
class ClientMessage:
    """A message that a client publishes on one of its channels."""

    channel: int
    data: bytes


@dataclass(frozen=True, slots=True)
class ServiceCall:
    """A request to a service; ``call`` is the client's number for the response."""

    service: int
    call: int
    encoding: str
    data: bytes


def message_data(subscription: int, received_ns: int, data: bytes) -> bytes:
    """Return a message of a subscription."""
    return _MESSAGE_HEAD.pack(_MESSAGE_DATA, subscription, received_ns) + data


def time_frame(time_ns: int) -> bytes:
    """Return the simulated time."""
    return _TIME_FRAME.pack(_TIME, time_ns)


def service_response(call: ServiceCall, data: bytes) -> bytes:
    """Return the response to a call."""
    encoding = CDR.encode()
    head = _SERVICE_HEAD.pack(_SERVICE_RESPONSE, call.service, call.call, len(encoding))
    return head + encoding + data


def parse_binary(frame: bytes) -> ClientMessage | ServiceCall:
    """Return what a client has sent. Raises BadRequestError."""
    kind = frame[0] if frame else None
    try:
        if kind == _CLIENT_MESSAGE:
            _, channel = _CLIENT_HEAD.unpack_from(frame)
            return ClientMessage(channel, frame[_CLIENT_HEAD.size :])
        if kind == _SERVICE_REQUEST:
            _, service, call, length = _SERVICE_HEAD.unpack_from(frame)
            start = _SERVICE_HEAD.size + length
            encoding = frame[_SERVICE_HEAD.size : start]
            if len(encoding) == length:
                text = encoding.decode("ascii", "replace")
                return ServiceCall(service, call, text, frame[start:])
    except struct.error:
        pass
    else:
        if kind not in (_CLIENT_MESSAGE, _SERVICE_REQUEST):
            name = "an empty message" if kind is None else f"a binary message with opcode {kind}"
            raise BadRequestError(f"{name} is not known")
    raise BadRequestError(f"a binary message with opcode {kind} ends after {len(frame)} bytes")


def parse_text(text: str) -> tuple[str, Values]:
    """Return the operation and the keys of a JSON message. Raises BadRequestError."""
    content = parse_object(text)
    check_characters(text, content)
    op = content.get("op")
    if not isinstance(op, str):
        raise BadRequestError("the message has no string 'op'")
    return op, Values(content, f"'{op:.40}'")


def number(value: Any, key: str) -> int:
    """Return a number that a client has chosen for something of its own. Raises BadRequestError."""
    if type(value) is not int or not 0 <= value <= _MAX_NUMBER:
        raise BadRequestError(f"'{key}' must be an integer from 0 to {_MAX_NUMBER}")
    return value


def status(level: int, message: str, identifier: str | None = None) -> dict[str, Any]:
    """Return a message for the user of a client; it replaces one with the same identifier."""
    content = {"op": "status", "level": level, "message": message}
    return content if identifier is None else content | {"id": identifier}
