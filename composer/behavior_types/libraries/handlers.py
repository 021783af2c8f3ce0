"""What the composer passes to the handlers of a node, and what they return."""

from __future__ import annotations

from collections.abc import Mapping

from composer.behavior_types.values import NONE, ApiValue, Value
from composer.fast_dataclass import dataclass
from composer.field_types import ANYTHING
from composer.interfaces import Action, Interfaces, Message, Service
from composer.model import Node, PortKind

#: Handlers of transitions: they return nothing, or whether the transition may happen.
TRANSITIONS = ("on_configure", "on_activate", "on_deactivate", "on_cleanup", "on_shutdown")


@dataclass(frozen=True, slots=True)
class Handler:
    """The types of the arguments of a handler, without ``self``, and of its result."""

    arguments: tuple[Value, ...]
    returns: Value = NONE


def handlers_of(node: Node, interfaces: Interfaces) -> Mapping[str, Handler]:
    """Return the handlers of a node's ports and timers, by name."""
    found = {f"on_{timer.name.value}": Handler(()) for timer in node.timers}
    for port in node.ports:
        name = port.name.value
        match port.kind, interfaces.find(port.interface.value):
            case PortKind.SUBSCRIPTION, Message() as message:
                found[f"on_{name}"] = Handler((message,))
            case PortKind.SERVICE, Service() as service:
                found[f"on_{name}"] = Handler((service.request, service.response), service.response)
            case PortKind.ACTION_SERVER, Action() as action:
                found[f"on_{name}"] = Handler((ApiValue("Goal", port),), action.result)
                found[f"accept_{name}"] = Handler((action.goal,), ANYTHING)
    return found
