"""A port of the wrong kind, such as a subscription as a source."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import a, either
from composer.analysis.messages.reactions import sends
from composer.diagnostics import Diagnostic, Label, error
from composer.fast_dataclass import dataclass
from composer.model import Chain, ChannelKind, Connection, Endpoint, Port, PortKind

RULE = error(
    code="RC211",
    name="wrong-port-kind",
    summary="A port is used where a port of another kind is required.",
    why=(
        "Messages go from publishers to subscriptions, requests from clients to services. In "
        "the other direction, no data can flow."
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

#: For each kind of channel, the keys of a connection and the kinds of port they accept.
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
    """Check the endpoints of connections and the ports that reactions send through."""
    for connection in context.system.connections:
        yield from _connection(context, connection)
    for chain in context.system.chains:
        yield from _chain(context, chain)
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


def _chain(context: Context, chain: Chain) -> Iterator[Diagnostic]:
    for endpoint in chain.through:
        port = context.system.port(endpoint)
        if port is not None and port.kind is not PortKind.PUBLISHER:
            yield Diagnostic(
                RULE,
                f"chain '{chain.name}' consists of publishers, but '{endpoint.text}' "
                f"is {a(port.kind)}",
                endpoint.text.span,
                (Label(port.name.span, f"declared as {a(port.kind)}"),),
            )


@dataclass(frozen=True, slots=True)
class _Slot:
    """An endpoint of a connection: its key, the kind of port it requires, and the actual port."""

    endpoint: Endpoint
    key: str
    expected: PortKind
    port: Port

    @property
    def label(self) -> Label:
        return Label(self.port.name.span, f"'{self.endpoint.text}' is {a(self.port.kind)}")


def _connection(context: Context, connection: Connection) -> Iterator[Diagnostic]:
    slots = list(_slots(context, connection))
    wrong = [slot for slot in slots if slot.port.kind is not slot.expected]
    kinds = {slot.port.kind.channel for slot in wrong}
    if len(wrong) > 1 and len(wrong) == len(slots) and len(kinds) == 1:
        yield _all_wrong(connection, wrong, kinds.pop())
        return
    for slot in wrong:
        actual = slot.port.kind
        yield Diagnostic(
            RULE,
            f"'{slot.key}' of {connection.kind} '{connection.name}' needs {a(slot.expected)}, "
            f"but '{slot.endpoint.text}' is {a(actual)}",
            slot.endpoint.text.span,
            (Label(slot.port.name.span, f"declared as {a(actual)}"),),
            _belongs(connection, actual),
        )


def _slots(context: Context, connection: Connection) -> Iterator[_Slot]:
    groups = (connection.sources, connection.sinks)
    for endpoints, (key, kind) in zip(groups, _ENDS[connection.kind], strict=True):
        for endpoint in endpoints:
            port = context.system.port(endpoint)
            if port is not None:
                yield _Slot(endpoint, key, kind, port)


def _all_wrong(connection: Connection, slots: list[_Slot], kind: ChannelKind) -> Diagnostic:
    """Report one diagnostic for a connection whose endpoints are all wrong."""
    (source_key, _), (sink_key, _) = _ENDS[connection.kind]
    if kind is connection.kind:
        message = f"the endpoints of {kind} '{connection.name}' are swapped"
        hint = f"swap '{source_key}' and '{sink_key}'"
    else:
        message = (
            f"'{connection.name}' connects the endpoints of {_an(kind)}, "
            f"not of {_an(connection.kind)}"
        )
        (source_key, _), (sink_key, _) = _ENDS[kind]
        hint = f"write '{kind}:', '{source_key}:' and '{sink_key}:'"
    labels = tuple(slot.label for slot in slots)
    return Diagnostic(RULE, message, connection.span, labels, hint)


def _belongs(connection: Connection, actual: PortKind) -> str:
    if actual.channel is connection.kind:
        other = next(key for key, kind in _ENDS[connection.kind] if kind is actual)
        return f"{a(actual)} belongs under '{other}'"
    return f"{a(actual)} belongs in a connection that starts with '{actual.channel}:'"


def _an(kind: ChannelKind) -> str:
    return f"{'an' if kind.value.startswith('a') else 'a'} {kind}"


def _hint(kind: PortKind) -> str | None:
    if kind is PortKind.PUBLISHER:
        return "use 'publish' to send a message"
    if kind in {PortKind.CLIENT, PortKind.ACTION_CLIENT}:
        return "use 'call' to send a request or a goal"
    return None
