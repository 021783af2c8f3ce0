"""A client that starts before its server."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import port_name
from composer.diagnostics import Diagnostic, Label, warning
from composer.model import Channel, ChannelKind, PortOfNode
from composer.model.dependencies import (
    dependency_cycles,
    dependency_edges,
    in_dependency_order,
)

RULE = warning(
    code="RC403",
    name="client-before-server",
    summary="A node that calls a service or action starts before the node that provides it.",
    why=(
        "By default, servers start before their clients. Here 'depends_on' reverses the "
        "order, so the first calls find no server."
    ),
    bad="""\
system: order
nodes:
  motor_controller:
    clients: {plan: {type: std_srvs/srv/Trigger}}
  planner:
    services: {plan: {type: std_srvs/srv/Trigger, respond: {success: true}}}
    lifecycle: {depends_on: [motor_controller]}
""",
    good="""\
system: order
nodes:
  motor_controller:
    clients: {plan: {type: std_srvs/srv/Trigger}}
    lifecycle: {depends_on: [planner]}
  planner:
    services: {plan: {type: std_srvs/srv/Trigger, respond: {success: true}}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the bring-up order with the services and actions."""
    system = context.system
    if dependency_cycles(system) or not system.implied_dependencies:
        return
    order = in_dependency_order(system, dependency_edges(system))
    rank = {name: place for place, name in enumerate(order)}
    for channel in context.channels:
        if channel.kind is ChannelKind.TOPIC or len(channel.sources) != 1:
            continue
        server = channel.sources[0]
        for client in channel.sinks:
            if rank[client.node.name.value] < rank[server.node.name.value]:
                yield _diagnostic(channel, client, server)


def _diagnostic(channel: Channel, client: PortOfNode, server: PortOfNode) -> Diagnostic:
    cause = next(iter(server.node.depends_on), None)
    place = cause.node.span if cause is not None else server.port.name.span
    return Diagnostic(
        RULE,
        f"'{port_name(client)}' starts before '{port_name(server)}', "
        f"the server of '{channel.name}'",
        client.port.name.span,
        (Label(place, f"'{server.node.name}' starts later"),),
        f"make '{client.node.name}' depend on '{server.node.name}'",
    )
