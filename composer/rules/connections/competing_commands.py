"""Two nodes that command the same actuator."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import port_name
from composer.diagnostics import Diagnostic, Label, warning
from composer.model import ChannelKind, PortOfNode, PrimaryState

RULE = warning(
    code="RC328",
    name="competing-commands",
    summary="Two nodes publish velocity commands on one topic.",
    why=(
        "The robot follows whichever command came last, and jerks between the two. Give "
        "each source a topic of its own, and select one in a multiplexer."
    ),
    bad="""\
system: driving
nodes:
  joystick:
    publishers: {command: {type: geometry_msgs/msg/Twist, qos: command, topic: cmd_vel}}
    timers: {tick: {period_ms: 100, publish: {command: {linear: {x: 0.5}}}}}
  navigation:
    publishers: {command: {type: geometry_msgs/msg/Twist, qos: command, topic: cmd_vel}}
    timers: {tick: {period_ms: 100, publish: {command: {linear: {x: 0.2}}}}}
  base:
    subscriptions:
      cmd_vel: {type: geometry_msgs/msg/Twist, qos: command, set: {x: "{message.linear.x}"}}
    state: {x: 0.0}
""",
    good="""\
system: driving
nodes:
  joystick:
    publishers: {command: {type: geometry_msgs/msg/Twist, qos: command, topic: cmd_vel_joy}}
    timers: {tick: {period_ms: 100, publish: {command: {linear: {x: 0.5}}}}}
  navigation:
    publishers: {command: {type: geometry_msgs/msg/Twist, qos: command, topic: cmd_vel}}
    timers: {tick: {period_ms: 100, publish: {command: {linear: {x: 0.2}}}}}
  base:
    subscriptions:
      cmd_vel: {type: geometry_msgs/msg/Twist, qos: command, set: {x: "{message.linear.x}"}}
      joystick: {type: geometry_msgs/msg/Twist, topic: cmd_vel_joy, qos: command, set: {x: 0.0}}
    state: {x: 0.0}
""",
)


_COMMANDS = frozenset(
    {
        "ackermann_msgs/msg/AckermannDrive",
        "ackermann_msgs/msg/AckermannDriveStamped",
        "geometry_msgs/msg/Twist",
        "geometry_msgs/msg/TwistStamped",
    }
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Count the nodes that publish velocity commands on each topic and start active."""
    system = context.system
    for channel in context.channels:
        if channel.kind is not ChannelKind.TOPIC:
            continue
        found: dict[str, PortOfNode] = {}
        for end in channel.sources:
            start = end.node.autostart.value if end.node.autostart else system.autostart
            if end.port.interface.value in _COMMANDS and start is PrimaryState.ACTIVE:
                found.setdefault(end.node.full_name, end)
        first = next(iter(found.values()), None)
        for other in found.values():
            if first is None or other is first:
                continue
            yield Diagnostic(
                RULE,
                f"'{port_name(other)}' and '{port_name(first)}' both command '{channel.name}'",
                other.port.name.span,
                (Label(first.port.name.span, "the other publisher"),),
                "use one topic for each, and a node that selects one of them",
            )
