"""A port in two conflicting connections."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved, location
from composer.diagnostics import Diagnostic, Label, error
from composer.model import Connection, Endpoint

RULE = error(
    code="RC212",
    name="port-connected-twice",
    summary="A port is twice in a connection, or in two with different names or QoS profiles.",
    why=(
        "A port has one name and one QoS profile in ROS, so one of the connections would have "
        "no effect."
    ),
    bad="""\
system: split
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, qos: command}}
  left:
    subscriptions: {chatter: {type: std_msgs/msg/String, qos: command}}
  right:
    subscriptions: {chatter: {type: std_msgs/msg/String, qos: command}}
connections:
  - {topic: /left/chatter, from: talker.chatter, to: left.chatter}
  - {topic: /right/chatter, from: talker.chatter, to: right.chatter}
""",
    good="""\
system: split
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, qos: command}}
  left:
    subscriptions: {chatter: {type: std_msgs/msg/String, qos: command}}
  right:
    subscriptions: {chatter: {type: std_msgs/msg/String, qos: command}}
connections:
  - {topic: /chatter, from: talker.chatter, to: [left.chatter, right.chatter]}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare each later connection of a port with its first one."""
    first: dict[str, tuple[Connection, Endpoint]] = {}
    reported: set[tuple[str, int, int]] = set()  # a pattern stands for several ports
    for connection in context.system.connections:
        for endpoint in connection.ends:
            if context.system.port(endpoint) is None or is_unresolved(endpoint.text.value):
                continue
            if is_unresolved(connection.name.value):
                continue
            earlier, place = first.setdefault(endpoint.text.value, (connection, endpoint))
            difference = _difference(earlier, connection)
            later = location(endpoint.text.span)
            if place is not endpoint and _is_repeated(place, endpoint, connection):
                yield Diagnostic(
                    RULE,
                    f"port '{endpoint.text}' is named twice",
                    endpoint.text.span,
                    (Label(place.text.span, "here too"),),
                    "did you mean another port?",
                )
            elif difference is not None and later not in reported:
                reported.add(later)
                yield Diagnostic(
                    RULE,
                    f"port '{endpoint.text}' is connected twice, with {difference}",
                    endpoint.text.span,
                    (Label(place.text.span, f"connected to '{earlier.name}' here"),),
                    "put all ports that share a name into one connection",
                )


def _is_repeated(first: Endpoint, second: Endpoint, connection: Connection) -> bool:
    """Return whether one connection names a port twice, both times without a pattern."""
    written = {first.text.span.text, second.text.span.text}
    is_within = any(end is first for end in connection.ends)
    is_elsewhere = location(first.text.span) != location(second.text.span)
    return is_within and is_elsewhere and written == {second.text.value}


def _difference(earlier: Connection, later: Connection) -> str | None:
    if earlier.kind is not later.kind:
        return None  # the wrong kind of port is reported by another rule
    if earlier.name.value.lstrip("/") != later.name.value.lstrip("/"):
        return f"the names '{earlier.name}' and '{later.name}'"
    if earlier.qos is not None and later.qos is not None and earlier.qos != later.qos:
        return f"the QoS profiles '{earlier.qos}' and '{later.qos}'"
    return None
