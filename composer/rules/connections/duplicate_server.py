"""Two servers of one service or action."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import port_name
from composer.diagnostics import Diagnostic, Label, error
from composer.model import Channel, ChannelKind, PortOfNode
from composer.source import Span

RULE = error(
    code="RC321",
    name="duplicate-server",
    summary="Two ports provide the same service or action.",
    why="Both answer every request, and the client receives whichever response arrives first.",
    bad="""\
system: servers
nodes:
  first:
    services: {reset: {type: std_srvs/srv/Trigger, respond: {success: true}}}
  second:
    services: {reset: {type: std_srvs/srv/Trigger, respond: {success: false}}}
""",
    good="""\
system: servers
nodes:
  first:
    services: {reset: {type: std_srvs/srv/Trigger, respond: {success: true}}}
  second:
    services:
      reset: {type: std_srvs/srv/Trigger, service: ~/reset, respond: {success: false}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Count the servers of every service and action."""
    for channel in context.channels:
        if channel.kind is ChannelKind.TOPIC or len(channel.sources) < 2:
            continue
        first = channel.sources[0]
        for other in channel.sources[1:]:
            yield Diagnostic(
                RULE,
                f"{channel.kind} '{channel.name}' is provided by both '{port_name(other)}' "
                f"and '{port_name(first)}'",
                _named_at(other),
                (Label(_named_at(first), "the other server"),),
                _hint(channel, other),
            )


def _named_at(server: PortOfNode) -> Span:
    """Return where a server gets its name: in a connection, or in its declaration."""
    return server.port.connected_at or server.port.name.span


def _hint(channel: Channel, other: PortOfNode) -> str:
    """Suggest a name below the node, unless the server has that name already."""
    node, port = other.node, other.port
    if f"{node.full_name}/{port.name}" == channel.name:
        return "rename one of them"
    return f"rename one of them, for example to '~/{port.name}'"
