"""The kinds of the ports that connections, chains and reactions name."""

from __future__ import annotations

from collections.abc import Iterator

from composer.base.diagnostics import Diagnostic, Label, error
from composer.base.fast_dataclass import dataclass
from composer.model import Chain, ChannelKind, Connection, Endpoint, Port, PortKind
from composer.rules.analysis.context import Context
from composer.rules.analysis.expressions import SENDERS, sends
from composer.rules.analysis.formatting import a, either
from composer.rules.analysis.subjects import connection_subjects, port_subject

WRONG_PORT_KIND = error("RC211", "wrong-port-kind")


def check_wrong_port_kind(context: Context) -> Iterator[Diagnostic]:
    """Check the endpoints of connections and the ports that reactions send through."""
    for connection in context.system.connections:
        yield from _wrong_ports_of_connection(context, connection)
    for chain in context.system.chains:
        yield from _wrong_ports_of_chain(context, chain)
    for site, key, send in sends(context.system):
        port = site.node.port(send.port.value)
        allowed = SENDERS[key]
        if port is not None and port.kind not in allowed:
            yield Diagnostic(
                WRONG_PORT_KIND,
                f"'{key}' needs {either(allowed)}, but '{port.name}' is {a(port.kind)}",
                send.port.span,
                (Label(port.name.span, f"declared as {a(port.kind)}"),),
                _sending_hint(port.kind),
                (port_subject(site.node, port),),
            )


def _wrong_ports_of_chain(context: Context, chain: Chain) -> Iterator[Diagnostic]:
    for endpoint in chain.through:
        port = context.system.port(endpoint)
        if port is not None and port.kind is not PortKind.PUBLISHER:
            yield Diagnostic(
                WRONG_PORT_KIND,
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


def _wrong_ports_of_connection(context: Context, connection: Connection) -> Iterator[Diagnostic]:
    slots = list(_slots(context, connection))
    wrong = [slot for slot in slots if slot.port.kind is not slot.expected]
    kinds = {slot.port.kind.channel for slot in wrong}
    if len(wrong) > 1 and len(wrong) == len(slots) and len(kinds) == 1:
        yield _all_wrong(context, connection, wrong, kinds.pop())
        return
    for slot in wrong:
        actual = slot.port.kind
        yield Diagnostic(
            WRONG_PORT_KIND,
            f"'{slot.key}' of {connection.kind} '{connection.name}' needs {a(slot.expected)}, "
            f"but '{slot.endpoint.text}' is {a(actual)}",
            slot.endpoint.text.span,
            (Label(slot.port.name.span, f"declared as {a(actual)}"),),
            _belongs(connection, actual),
            (("port", slot.endpoint.text.value), *connection_subjects(context.system, connection)),
        )


def _slots(context: Context, connection: Connection) -> Iterator[_Slot]:
    groups = (connection.sources, connection.sinks)
    kind = connection.kind
    for endpoints, key, expected in zip(groups, kind.keys_of_ends, kind.ends, strict=True):
        for endpoint in endpoints:
            port = context.system.port(endpoint)
            if port is not None:
                yield _Slot(endpoint, key, expected, port)


def _all_wrong(
    context: Context, connection: Connection, slots: list[_Slot], kind: ChannelKind
) -> Diagnostic:
    """Report one diagnostic for a connection whose endpoints are all wrong."""
    source_key, sink_key = connection.kind.keys_of_ends
    if kind is connection.kind:
        message = f"the endpoints of {kind} '{connection.name}' are swapped"
        hint = f"swap '{source_key}' and '{sink_key}'"
    else:
        message = (
            f"'{connection.name}' connects the endpoints of {a(kind)}, not of {a(connection.kind)}"
        )
        source_key, sink_key = kind.keys_of_ends
        hint = f"write '{kind}:', '{source_key}:' and '{sink_key}:'"
    labels = tuple(slot.label for slot in slots)
    subjects = connection_subjects(context.system, connection)
    return Diagnostic(WRONG_PORT_KIND, message, connection.span, labels, hint, subjects)


def _belongs(connection: Connection, actual: PortKind) -> str:
    if actual.channel is connection.kind:
        other = connection.kind.keys_of_ends[0 if actual.is_source else 1]
        return f"{a(actual)} belongs under '{other}'"
    return f"{a(actual)} belongs in a connection that starts with '{actual.channel}:'"


def _sending_hint(kind: PortKind) -> str | None:
    if kind is PortKind.PUBLISHER:
        return "use 'publish' to send a message"
    if kind in {PortKind.CLIENT, PortKind.ACTION_CLIENT}:
        return "use 'call' to send a request or a goal"
    return None
