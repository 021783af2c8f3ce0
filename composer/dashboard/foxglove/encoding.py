"""What is sent, without ROS: messages of the protocol, and definitions of interfaces as text.

Numbers in binary messages are little-endian. A schema is a message with everything in it.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from functools import lru_cache
from typing import Any

from composer.base.fast_dataclass import dataclass
from composer.dashboard.protocol.messages import (
    BadRequestError,
    Values,
    check_characters,
    parse_object,
)
from composer.interfaces import FieldType, Interfaces, Message, Service
from composer.language.tree import Plain

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
_SEPARATOR = "=" * 80
_MAX_SCHEMAS = 10_000


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


class Schemas:
    """Makes schemas from the definitions of interfaces; each is made once."""

    def __init__(self, interfaces: Interfaces) -> None:
        self._interfaces = interfaces
        # With a limit: any node can announce names of types.
        self.message = lru_cache(_MAX_SCHEMAS)(self._message)
        self.service = lru_cache(_MAX_SCHEMAS)(self._service)

    def _message(self, name: str) -> str | None:
        """Return the schema of a message; None if a definition is not known."""
        found = self._interfaces.message(name)
        return None if found is None else self._text(found)

    def _service(self, name: str) -> tuple[str, str] | None:
        """Return the schemas of the request and the response of a service, or None."""
        found = self._interfaces.find(name)
        if not isinstance(found, Service):
            return None
        request, response = self._text(found.request), self._text(found.response)
        return None if request is None or response is None else (request, response)

    def _text(self, message: Message) -> str | None:
        inner: dict[str, Message] = {}
        pending = [message]
        while pending:
            for field in pending.pop().fields:
                name = field.type.name
                if field.type.is_primitive or name in inner:
                    continue
                found = self._interfaces.message(name)
                if found is None:
                    return None
                inner[name] = found
                pending.append(found)
        parts = [_definition(message)]
        parts += [f"MSG: {_short(name)}\n{_definition(found)}" for name, found in inner.items()]
        return f"{_SEPARATOR}\n".join(parts)


def _definition(message: Message) -> str:
    return "".join(f"{line}\n" for line in _lines(message))


def _lines(message: Message) -> Iterator[str]:
    # With full names: clients look for a relative one in all packages.
    for constant in message.constants:
        yield f"{constant.type} {constant.name}={_literal(constant.value)}"
    for field in message.fields:
        default = "" if field.default is None else f" {_literal(field.default)}"
        yield f"{_type(field.type)} {field.name}{default}"


def _type(type_: FieldType) -> str:
    return str(type_) if type_.is_primitive else str(type_).replace(type_.name, _short(type_.name))


def _short(name: str) -> str:
    """Return ``package/Name`` for ``package/msg/Name``."""
    package, _, last = name.split("/")
    return f"{package}/{last}"


def _literal(value: Plain) -> str:
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_literal, value))}]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    return str(value).lower() if isinstance(value, bool) else str(value)
