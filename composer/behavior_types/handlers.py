"""What the composer passes to the handlers of a node."""

from __future__ import annotations

from collections.abc import Mapping

from composer.behavior_types.values import ApiValue, Value
from composer.interfaces import Action, Interfaces, Message, Service
from composer.model import Node, PortKind


def handler_arguments(node: Node, interfaces: Interfaces) -> Mapping[str, tuple[Value, ...]]:
    """Return the types of the arguments of the handlers of a node's ports."""
    found: dict[str, tuple[Value, ...]] = {}
    for port in node.ports:
        name = port.name.value
        match port.kind, interfaces.find(port.interface.value):
            case PortKind.SUBSCRIPTION, Message() as message:
                found[f"on_{name}"] = (message,)
            case PortKind.SERVICE, Service() as service:
                found[f"on_{name}"] = (service.request, service.response)
            case PortKind.ACTION_SERVER, Action() as action:
                found[f"on_{name}"] = (ApiValue("Goal", port),)
                found[f"accept_{name}"] = (action.goal,)
    return found
