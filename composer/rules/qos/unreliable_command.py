"""A command topic with best-effort delivery."""

from __future__ import annotations

import re
from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, info
from composer.model import PortKind
from composer.qos import Reliability

RULE = info(
    code="RC316",
    name="unreliable-command",
    summary="A topic whose name suggests commands is best effort.",
    why=(
        "A lost reading is followed by the next one; a lost command is never executed. The "
        "'command' preset is reliable."
    ),
    bad="""\
system: orders
nodes:
  planner:
    publishers:
      motor_commands: {type: geometry_msgs/msg/Twist, qos: sensor_data, external: true}
""",
    good="""\
system: orders
nodes:
  planner:
    publishers:
      motor_commands: {type: geometry_msgs/msg/Twist, qos: command, external: true}
""",
)

_COMMAND = re.compile(r"(^|[/_])(cmd|command|commands|order|orders)($|[/_])")


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the reliability of publishers whose topic name suggests commands."""
    for node in context.system.nodes:
        for port in node.ports_of(PortKind.PUBLISHER):
            if not port.qos.known or port.qos.profile.reliability is Reliability.RELIABLE:
                continue
            if _COMMAND.search(port.full_name):
                yield Diagnostic(
                    RULE,
                    f"'{port.full_name}' carries commands, but is best effort and may lose them",
                    port.qos.policy_span("reliability"),
                    hint="use 'qos: command'",
                )
