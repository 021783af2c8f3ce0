"""Servers and clients of services and actions."""

from __future__ import annotations

from collections.abc import Iterator

from composer.base.diagnostics import Diagnostic, Label, error, info
from composer.base.source import Span
from composer.model import Channel, ChannelKind, ImplementationKind, PortKind, PortOfNode
from composer.model.dependencies import dependency_cycles, in_dependency_order
from composer.rules.analysis.context import Context
from composer.rules.analysis.earlier_errors import earlier_errors
from composer.rules.analysis.formatting import number, port_name
from composer.rules.analysis.subjects import NAMESPACES, port_subject, wiring
from composer.rules.lifecycle import START_ORDER

DUPLICATE_SERVER = error("RC321", "duplicate-server")
UNSUITED_PATTERN = info("RC331", "unsuited-pattern")


def check_duplicate_server(context: Context) -> Iterator[Diagnostic]:
    """Count the servers of every service and action."""
    for channel in context.channels:
        if channel.kind is ChannelKind.TOPIC or len(channel.sources) < 2:
            continue
        first = channel.sources[0]
        for other in channel.sources[1:]:
            yield Diagnostic(
                DUPLICATE_SERVER,
                f"{channel.kind} '{channel.name}' is provided by both '{port_name(other)}' "
                f"and '{port_name(first)}'",
                _named_at(other),
                (Label(_named_at(first), "the other server"),),
                _other_name_hint(channel, other),
                relies_on=(
                    *NAMESPACES,
                    port_subject(first.node, first.port),
                    port_subject(other.node, other.port),
                    *wiring(first.node, first.port),
                    *wiring(other.node, other.port),
                ),
            )


def _named_at(server: PortOfNode) -> Span:
    """Return where a server gets its name: in a connection, or in its declaration."""
    return server.port.connected_at or server.port.name.span


def _other_name_hint(channel: Channel, other: PortOfNode) -> str:
    """Suggest a name below the node, unless the server has that name already."""
    node, port = other.node, other.port
    if f"{node.full_name}/{port.name}" == channel.name:
        return "rename one of them"
    return f"rename one of them, for example to '~/{port.name}'"


def check_client_before_server(context: Context) -> Iterator[Diagnostic]:
    """Compare the bring-up order with the services and actions."""
    system = context.system
    if dependency_cycles(system) or not system.implied_dependencies:
        return
    order = in_dependency_order(system)
    rank = {name: place for place, name in enumerate(order)}
    for channel in context.channels:
        if channel.kind is ChannelKind.TOPIC or len(channel.sources) != 1:
            continue
        server = channel.sources[0]
        for client in channel.sinks:
            if rank[client.node.name.value] < rank[server.node.name.value]:
                yield _started_too_early(channel, client, server)


def _started_too_early(channel: Channel, client: PortOfNode, server: PortOfNode) -> Diagnostic:
    cause = next(iter(server.node.depends_on), None)
    place = cause.node.span if cause is not None else server.port.name.span
    return Diagnostic(
        START_ORDER,
        f"'{port_name(client)}' starts before '{port_name(server)}', "
        f"the server of '{channel.name}'",
        client.port.name.span,
        (Label(place, f"'{server.node.name}' starts later"),),
        f"make '{client.node.name}' depend on '{server.node.name}'",
    )


_LONGEST_POLL_S = 1.0


def check_polled_service(context: Context) -> Iterator[Diagnostic]:
    """Check the calls that timers make unconditionally."""
    for node in context.system.nodes:
        for timer in node.timers:
            period_s = node.period_s(timer)
            if timer.reaction is None or timer.reaction.when is not None or period_s is None:
                continue
            for send in timer.reaction.call:
                port = node.port(send.port.value)
                if port is None or port.kind is not PortKind.CLIENT or period_s >= _LONGEST_POLL_S:
                    continue
                yield Diagnostic(
                    UNSUITED_PATTERN,
                    f"timer '{timer.name}' calls service '{port.full_name}' "
                    f"{number(1 / period_s)} times a second",
                    send.port.span,
                    (Label(timer.period.span, "the timer's period"),),
                    "publish the data on a topic instead",
                )


def check_action_as_service(context: Context) -> Iterator[Diagnostic]:
    """Check the action servers that are declared entirely in YAML."""
    affected = context.once(earlier_errors).nodes  # feedback may be misspelled
    for node in context.system.nodes:
        if node.implementation is not ImplementationKind.DECLARATIVE:
            continue
        if node.name.value in affected:
            continue
        for port in node.ports_of(PortKind.ACTION_SERVER):
            if port.result is not None and port.feedback is None:
                yield Diagnostic(
                    UNSUITED_PATTERN,
                    f"action server '{port.name}' returns its result immediately, like a service",
                    port.name.span,
                    hint="use a service, or add feedback",
                )
