"""Which interfaces may carry large messages."""

from __future__ import annotations

from functools import cache
from typing import Any

from rosidl_parser.definition import (
    AbstractNestedType,
    AbstractSequence,
    Array,
    BasicType,
    BoundedSequence,
    NamespacedType,
)

from composer.model import Port, PortKind, System
from composer.runtime.ros.messages import MessageError, interface_class

#: Fast DDS splits larger messages.
_LARGE_BYTES = 65_500
_BYTES = {"int16": 2, "uint16": 2, "int32": 4, "uint32": 4, "float": 4}
_BYTES |= {"int64": 8, "uint64": 8, "double": 8, "long double": 16}
#: What ports send, if their interface has more than one message.
_PARTS = {
    PortKind.SERVICE: ("Response",),
    PortKind.CLIENT: ("Request",),
    PortKind.ACTION_SERVER: ("Result", "Feedback"),
    PortKind.ACTION_CLIENT: ("Goal",),
}


def sends_large_messages(system: System) -> bool:
    """Say whether a port of a node in the process of the system sends messages that may be large.

    They have an array of numbers that is unbounded or too large for one datagram, such as
    images, point clouds and maps.
    """
    nodes = (node for node in system.nodes if node.in_process)
    return any(_sends_large(port) for node in nodes for port in node.ports)


def _sends_large(port: Port) -> bool:
    if port.kind is PortKind.SUBSCRIPTION:
        return False
    try:
        interface = interface_class(port.interface.value)
        parts = _PARTS.get(port.kind)
        sent = [interface] if parts is None else [getattr(interface, part) for part in parts]
        return any(map(may_be_large, sent))
    except MessageError:  # the node reports it when it is configured
        return False


@cache
def may_be_large(message_class: Any) -> bool:
    """Say whether a message, or one within it, has a possibly large array of numbers."""
    return any(map(_is_large, message_class.SLOT_TYPES))


def _is_large(slot_type: Any) -> bool:
    if not isinstance(slot_type, AbstractNestedType):
        return isinstance(slot_type, NamespacedType) and _contains_large(slot_type)
    element = slot_type.value_type
    if isinstance(element, NamespacedType):
        return _contains_large(element)
    if not isinstance(element, BasicType):
        return False
    match slot_type:
        case Array():
            count = slot_type.size
        case BoundedSequence():
            count = slot_type.maximum_size
        case AbstractSequence():
            return True
    return bool(count * _BYTES.get(element.typename, 1) > _LARGE_BYTES)


def _contains_large(slot_type: NamespacedType) -> bool:
    return may_be_large(interface_class("/".join(slot_type.namespaced_name())))
