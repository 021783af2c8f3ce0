"""A process that the others of its system cannot discover."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, error

RULE = error(
    code="RC482",
    name="separate-process",
    summary="The environment of a process separates it from the other processes.",
    why=(
        "A process in another ROS domain, or without discovery, cannot be brought up, and its "
        "nodes receive nothing from the others."
    ),
    bad="""\
system: robot
processes:
  vision: {nodes: [camera], environment: {ROS_DOMAIN_ID: "7"}}
nodes:
  camera: {on_activate: {log: started}}
""",
    good="""\
system: robot
processes:
  vision: {nodes: [camera], environment: {OMP_NUM_THREADS: "2"}}
nodes:
  camera: {on_activate: {log: started}}
""",
)
_DOMAIN, _RANGE = "ROS_DOMAIN_ID", "ROS_AUTOMATIC_DISCOVERY_RANGE"


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the variables that the processes set."""
    for process in context.system.processes:
        for name, value in process.environment:
            if name.value == _DOMAIN:
                yield Diagnostic(
                    RULE,
                    f"process '{process.name}' would be in a ROS domain of its own",
                    name.span,
                    hint=f"set {_DOMAIN} for 'compose run' instead, which all processes inherit",
                )
            elif name.value == _RANGE and value == "OFF":
                yield Diagnostic(
                    RULE,
                    f"process '{process.name}' would discover no other process",
                    name.span,
                    hint="remove it",
                )
