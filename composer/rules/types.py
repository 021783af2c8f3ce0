"""Topics, services and actions whose ports have different types."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import replace

from composer.base.diagnostics import Diagnostic, Label, Subject, error
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.model import Channel, Connection, Endpoint, PortOfNode
from composer.model.names import join
from composer.rules.analysis.context import Context
from composer.rules.analysis.expressions import field_problems
from composer.rules.analysis.formatting import port_name
from composer.rules.analysis.subjects import connection_subjects, port_subject, type_subject

TYPE_MISMATCH = error("RC303", "type-mismatch")

_SEVERAL = 2
#: Maximum number of further endpoints with the same wrong type to show.
_SHOWN_ENDPOINTS = 3


@dataclass(frozen=True, slots=True)
class TypeMismatch:
    """A channel with several types: a port with the usual one, and all ports with others."""

    channel: Channel
    usual: PortOfNode
    others: Mapping[str, list[PortOfNode]]


def type_mismatches(context: Context) -> tuple[TypeMismatch, ...]:
    """Return the channels with several types."""
    return tuple(_mismatches(context))


def certain_field_problems(context: Context) -> Iterator[Diagnostic]:
    """Yield the problems with fields, except of ports whose type is probably wrong."""
    doubtful = {
        endpoint.key
        for mismatch in context.once(type_mismatches)
        for endpoints in mismatch.others.values()
        for endpoint in endpoints
    }
    for found in context.once(field_problems):
        if found.port not in doubtful:
            yield found.problem


def wrong_connection(
    context: Context, endpoint: PortOfNode, mismatch: TypeMismatch
) -> Endpoint | None:
    """Return where a port is connected, if the connection is probably wrong and not its type.

    That is so if another connection of the port fits its type, or if what the node does with the
    port fits its type and not that of the channel.
    """
    here: list[Endpoint] = []
    elsewhere: list[Connection] = []
    for connection in context.system.connections:
        own = [end for end in connection.ends if (end.node, end.port) == endpoint.key]
        if not own or connection.kind is not mismatch.channel.kind:
            continue
        if _channel_name(context, connection) == mismatch.channel.name:
            here.extend(own)
        else:
            elsewhere.append(connection)
    if here and (
        any(_has_type(context, connection, endpoint) for connection in elsewhere)
        or _fits_only_own(context, endpoint, mismatch.usual.port.interface.value)
    ):
        return here[0]
    return None


def misnamed_port(context: Context, mismatch: TypeMismatch) -> tuple[Endpoint, str] | None:
    """Return where a connection names a wrong port of a node, and the one that is meant.

    The other one has the type of the channel, and the name of the channel or of another port on it.
    """
    ends = {endpoint.key for endpoint in mismatch.channel.ends}
    for connection in _connections(context, mismatch):
        for end in connection.ends:
            meant = _meant_port(context, connection, end) if (end.node, end.port) in ends else None
            if meant is not None:
                return end, f"{end.node}.{meant}"
    return None


def _meant_port(context: Context, connection: Connection, end: Endpoint) -> str | None:
    """Return the port that a connection means where it names another one, None if it does not."""
    node, port = context.system.node(end.node), context.system.port(end)
    if node is None or port is None:
        return None
    ports = (context.system.port(item) for item in connection.ends)
    others = [other for other in ports if other is not None and other is not port]
    names = {other.name.value for other in others}
    names.add(connection.name.value.rpartition("/")[2])
    types = {other.interface.value for other in others} - {port.interface.value}
    if port.name.value in names:
        return None
    for meant in node.ports_of(port.kind):
        if meant.interface.value in types and meant.name.value in names and meant not in others:
            return meant.name.value
    return None


def misnamed_connection(context: Context, mismatch: TypeMismatch) -> Connection | None:
    """Return the connection that has the name of another one with ports of another type."""
    connections = _connections(context, mismatch)
    types = [
        {
            port.interface.value
            for end in connection.ends
            if (port := context.system.port(end)) is not None
        }
        for connection in connections
    ]
    if len(connections) < _SEVERAL or any(len(found) != 1 for found in types):
        return None
    usual = mismatch.usual.port.interface.value
    last = mismatch.channel.name.rpartition("/")[2]
    wrong = [item for item in connections if all(end.port != last for end in item.ends)]
    if len(wrong) == len(connections):
        wrong = [item for item, found in zip(connections, types, strict=True) if usual not in found]
    has_both = all(item.sources and item.sinks for item in wrong)
    return wrong[0] if len(wrong) == 1 and has_both else None


def _connections(context: Context, mismatch: TypeMismatch) -> list[Connection]:
    """Return the connections that give a channel its name."""
    channel = mismatch.channel
    return [
        connection
        for connection in context.system.connections
        if connection.kind is channel.kind and _channel_name(context, connection) == channel.name
    ]


def _channel_name(context: Context, connection: Connection) -> str:
    return join(context.system.namespace, connection.name.value)


def _has_type(context: Context, connection: Connection, endpoint: PortOfNode) -> bool:
    """Return whether another port of a connection has the type of a port."""
    ports = (
        context.system.port(end) for end in connection.ends if (end.node, end.port) != endpoint.key
    )
    own = endpoint.port.interface.value
    return any(port is not None and port.interface.value == own for port in ports)


def _fits_only_own(context: Context, endpoint: PortOfNode, other: str) -> bool:
    """Return whether what a node does with a port fits its type, and not another one."""
    key, node, port = endpoint.key, endpoint.node, endpoint.port
    if any(found.port == key for found in context.once(field_problems)):
        return False
    changed = replace(port, interface=port.interface.map(lambda _: other))
    ports = tuple(changed if item is port else item for item in node.ports)
    system = replace(context.system, nodes=(replace(node, ports=ports),))
    supposed = Context(system, context.interfaces, context.node_types)
    return any(found.port == key for found in field_problems(supposed))


def _mismatches(context: Context) -> Iterator[TypeMismatch]:
    troubled = {found.port for found in context.once(field_problems)}
    for channel in context.all_channels:
        by_type: dict[str, list[PortOfNode]] = defaultdict(list)
        for endpoint in channel.ends:
            if context.interface(endpoint.port) is not None:
                by_type[endpoint.port.interface.value].append(endpoint)
        if len(by_type) > 1:
            yield _mismatch(channel, by_type, troubled)


def _mismatch(
    channel: Channel, by_type: dict[str, list[PortOfNode]], troubled: set[tuple[str, str] | None]
) -> TypeMismatch:
    """Choose the usual type: one that fits what its nodes do, then the most common.

    Of the others, that of a node type: other systems may use it. Else the first.
    """

    def weight(name: str) -> tuple[bool, int, bool]:
        endpoints = by_type[name]
        fits = not any(endpoint.key in troubled for endpoint in endpoints)
        return fits, len(endpoints), any(map(_is_of_node_type, endpoints))

    common = max(by_type, key=weight)
    others = {name: endpoints for name, endpoints in by_type.items() if name != common}
    return TypeMismatch(channel, by_type[common][0], others)


def _is_of_node_type(endpoint: PortOfNode) -> bool:
    return endpoint.port.interface.span.file != endpoint.node.name.span.file


def check_type_mismatch(context: Context) -> Iterator[Diagnostic]:
    """Compare the types on every channel; report each type other than the most common one."""
    for mismatch in context.once(type_mismatches):
        misnamed = misnamed_port(context, mismatch)
        if misnamed is not None:
            yield _wrong_port(context, mismatch, *misnamed)
            continue
        for name, endpoints in mismatch.others.items():
            yield _wrong_type(context, mismatch, name, endpoints)


def _wrong_port(context: Context, mismatch: TypeMismatch, end: Endpoint, meant: str) -> Diagnostic:
    """Report a connection that names the wrong port of a node."""
    channel = mismatch.channel
    wrong = next(item for item in channel.ends if item.key == (end.node, end.port))
    own = wrong.port.interface.value
    other = next(item for item in channel.ends if item.port.interface.value != own)
    return Diagnostic(
        TYPE_MISMATCH,
        f"{wrong.port.kind} '{end.text}' has type '{own}', "
        f"but {channel.kind} '{channel.name}' has '{other.port.interface}'",
        end.text.span,
        (Label(other.port.interface.span, f"the type of {other.port.kind} '{port_name(other)}'"),),
        f"did you mean '{meant}'?",
        (*_types(channel), *_names_given_at(context, end.text.span)),
    )


def _types(channel: Channel) -> Iterator[Subject]:
    """Yield the types of all ports of a channel: any of them may be the wrong one."""
    return (port_subject(end.node, end.port, "type") for end in channel.ends)


def _names_given_at(context: Context, place: Span) -> tuple[Subject, ...]:
    """Return the names that a connection gives, if one of its ends or its name is at a place."""
    return tuple(
        subject
        for connection in context.system.connections
        for end in connection.ends
        if place in (end.text.span, connection.name.span)
        for subject in connection_subjects(context.system, connection, end)
    )


def _wrong_type(
    context: Context, mismatch: TypeMismatch, name: str, endpoints: list[PortOfNode]
) -> Diagnostic:
    channel, usual, different = mismatch.channel, mismatch.usual, endpoints[0]
    common = usual.port.interface.value
    labels = [Label(usual.port.interface.span, f"{usual.port.kind} '{port_name(usual)}': {common}")]
    labels += [
        Label(
            endpoint.port.interface.span,
            f"{endpoint.port.kind} '{port_name(endpoint)}' too: {name}",
        )
        for endpoint in endpoints[1 : 1 + _SHOWN_ENDPOINTS]
    ]
    primary = different.port.interface.span
    named_twice = misnamed_connection(context, mismatch)
    connected = wrong_connection(context, different, mismatch)
    hint = None
    if named_twice is not None:
        labels.append(Label(primary, f"its type: {name}"))
        primary = named_twice.name.span
        hint = "another connection has the same name"
    elif connected is not None:
        labels.append(Label(primary, f"its type, which fits its node: {name}"))
        primary = connected.text.span
    return Diagnostic(
        TYPE_MISMATCH,
        f"{different.port.kind} '{port_name(different)}' has type '{name}', "
        f"but {channel.kind} '{channel.name}' has '{common}'",
        primary,
        tuple(labels),
        hint,
        (
            *_types(channel),
            *_names_given_at(context, primary),
        ),
        tuple(type_subject(end.port) for end in channel.ends),
    )
