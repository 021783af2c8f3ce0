"""More services for tools than the processes of a system can discover."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, warning

RULE = warning(
    code="RC488",
    name="many-services",
    summary="The processes of a system have so many services for tools that it may not start.",
    why=(
        "A node has about 28 endpoints for tools: services for parameters and its lifecycle, "
        "and publishers of its log and its changes. Each process compares its own endpoints "
        "with those of all others, so the time to start grows with the square of their number. "
        "On two processors, ten processes with 200 nodes take half a minute, and 400 nodes do "
        "not come up. Commands of compose need none of these services."
    ),
    bad="""\
system: fleet
processes: {second: {nodes: ["robot_*"]}}
nodes:
  station: {on_activate: {log: started}}
  "robot_${index}": {for_each: {index: 200}, on_activate: {log: started}}
""",
    good="""\
system: fleet
introspection: {parameters: false, type_description: false, lifecycle_services: false}
processes: {second: {nodes: ["robot_*"]}}
nodes:
  station: {on_activate: {log: started}}
  "robot_${index}": {for_each: {index: 200}, on_activate: {log: started}}
""",
)
#: Of about 180 nodes with all services.
_MOST_ENDPOINTS = 5000


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the services of nodes if they are in several processes."""
    system = context.system
    if not system.processes:
        return
    found = [
        node.introspection.endpoints for node in system.nodes if node.implementation.in_process
    ]
    if sum(found) > _MOST_ENDPOINTS:
        yield Diagnostic(
            RULE,
            f"the nodes have about {sum(found)} endpoints for tools: their processes may not start "
            "within the time limit",
            system.name.span,
            hint="disable those that no tool uses, in 'introspection' of the system",
        )
