"""An interface of the wrong kind, such as a service type on a topic."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import a
from composer.diagnostics import Diagnostic, error
from composer.interfaces import Action, Message, Service
from composer.model import ChannelKind

RULE = error(
    code="RC302",
    name="wrong-interface-kind",
    summary="A port has an interface of the wrong kind, such as a service type on a topic.",
    why="Topics use message types; services and actions have their own kinds of type.",
    bad="""\
system: kinds
nodes:
  talker:
    publishers: {trigger: {type: std_srvs/srv/Trigger, qos: command, external: true}}
""",
    good="""\
system: kinds
nodes:
  talker:
    clients: {trigger: {type: std_srvs/srv/Trigger, external: true}}
""",
)

_EXPECTED = {
    ChannelKind.TOPIC: "a message type",
    ChannelKind.SERVICE: "a service type",
    ChannelKind.ACTION: "an action type",
}
_KINDS = {
    Message: ChannelKind.TOPIC,
    Service: ChannelKind.SERVICE,
    Action: ChannelKind.ACTION,
}


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the kind of every port's type."""
    for node in context.system.nodes:
        for port in node.ports:
            found = context.interfaces.find(port.interface.value)
            if found is None or _KINDS[type(found)] is port.kind.channel:
                continue
            yield Diagnostic(
                RULE,
                f"'{port.interface}' is {_EXPECTED[_KINDS[type(found)]]}, "
                f"but {a(port.kind)} needs {_EXPECTED[port.kind.channel]}",
                port.interface.span,
            )
