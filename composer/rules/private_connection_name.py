"""A connection with a name that begins with ``~``."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC233",
        name="private-connection-name",
        severity=Severity.ERROR,
        summary="A connection's name is private, but a connection belongs to no one node.",
        why="'~' stands for the node a name is used in; between nodes it stands for nothing.",
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
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Look at the names of connections."""
    for connection in context.system.connections:
        name = connection.name
        if name.value.startswith("~"):
            yield Diagnostic(
                RULE,
                f"{connection.kind} '{name}' is private, but a connection has no node of its own",
                name.span,
                hint="give an absolute name, such as '/node/topic'",
            )
