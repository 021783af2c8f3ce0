"""A port used as what it is not: a subscription as a source, a service in ``publish``."""

from __future__ import annotations

from collections.abc import Iterator

from composer.checks.context import Context
from composer.checks.reactions import sends
from composer.checks.words import a, either
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register
from composer.model import ChannelKind, Connection, Endpoint, PortKind

RULE = register(
    Rule(
        code="RC211",
        name="wrong-port-kind",
        severity=Severity.ERROR,
        summary="A port stands where a port of another kind is needed.",
        why=(
            "Messages leave from publishers and arrive at subscriptions; requests leave from "
            "clients and arrive at services. The other way round nothing could flow."
        ),
        bad="""\
system: swapped
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, qos: command}}
  listener:
    subscriptions: {chatter: {type: std_msgs/msg/String, qos: command}}
connections:
  - {topic: /chatter, from: talker.chatter, to: talker.chatter}
""",
        good="""\
system: swapped
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, qos: command}}
  listener:
    subscriptions: {chatter: {type: std_msgs/msg/String, qos: command}}
connections:
  - {topic: /chatter, from: talker.chatter, to: listener.chatter}
""",
    )
)

#: For each kind of channel the keys of a connection and the kinds of port they take.
_ENDS = {
    ChannelKind.TOPIC: (("from", PortKind.PUBLISHER), ("to", PortKind.SUBSCRIPTION)),
    ChannelKind.SERVICE: (("server", PortKind.SERVICE), ("clients", PortKind.CLIENT)),
    ChannelKind.ACTION: (("server", PortKind.ACTION_SERVER), ("clients", PortKind.ACTION_CLIENT)),
}
_SENDERS = {
    "publish": (PortKind.PUBLISHER,),
    "call": (PortKind.CLIENT, PortKind.ACTION_CLIENT),
}


def check(context: Context) -> Iterator[Diagnostic]:
    """Look at the ends of connections and at the ports that reactions send through."""
    for connection in context.system.connections:
        groups = (connection.sources, connection.sinks)
        for endpoints, (key, kind) in zip(groups, _ENDS[connection.kind], strict=True):
            for endpoint in endpoints:
                yield from _endpoint(context, connection, endpoint, key, kind)
    for site, key, send in sends(context.system):
        port = site.node.port(send.port.value)
        allowed = _SENDERS[key]
        if port is not None and port.kind not in allowed:
            yield Diagnostic(
                RULE,
                f"'{key}' needs {either(allowed)}, but '{port.name}' is {a(port.kind)}",
                send.port.span,
                (Label(port.name.span, f"declared as {a(port.kind)}"),),
                _hint(port.kind),
            )


def _endpoint(
    context: Context, connection: Connection, endpoint: Endpoint, key: str, kind: PortKind
) -> Iterator[Diagnostic]:
    port = context.system.port(endpoint)
    if port is None or port.kind is kind:
        return
    actual = port.kind
    if actual.channel is connection.kind:
        other = next(other for other, belongs in _ENDS[connection.kind] if belongs is actual)
        hint = f"{a(actual)} belongs under '{other}'"
    else:
        hint = f"{a(actual)} belongs in a connection that begins with '{actual.channel}:'"
    yield Diagnostic(
        RULE,
        f"'{key}' of {connection.kind} '{connection.name}' needs {a(kind)}, "
        f"but '{endpoint.text}' is {a(actual)}",
        endpoint.text.span,
        (Label(port.name.span, f"declared as {a(actual)}"),),
        hint,
    )


def _hint(kind: PortKind) -> str | None:
    if kind is PortKind.PUBLISHER:
        return "use 'publish' to send a message"
    if kind in {PortKind.CLIENT, PortKind.ACTION_CLIENT}:
        return "use 'call' to send a request or a goal"
    return None
