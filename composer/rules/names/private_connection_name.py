"""A connection whose name starts with ``~``."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, error

RULE = error(
    code="RC233",
    name="private-connection-name",
    summary="A connection has a private name, but does not belong to a single node.",
    why="'~' stands for the node that uses the name, and a connection has no such node.",
    bad="""\
system: private
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, qos: command}}
  listener:
    subscriptions: {chatter: {type: std_msgs/msg/String, qos: command}}
connections:
  - {topic: ~/chatter, from: talker.chatter, to: listener.chatter}
""",
    good="""\
system: private
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, qos: command}}
  listener:
    subscriptions: {chatter: {type: std_msgs/msg/String, qos: command}}
connections:
  - {topic: /talker/chatter, from: talker.chatter, to: listener.chatter}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the names of connections."""
    for connection in context.system.connections:
        name = connection.name
        if name.value.startswith("~"):
            yield Diagnostic(
                RULE,
                f"{connection.kind} '{name}' is private, but a connection is not part of a node",
                name.span,
                hint="use an absolute name, such as '/node/topic'",
            )
