"""Parameters for a node that does not exist."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, Rule, Severity, register, suggestion

RULE = register(
    Rule(
        code="RC246",
        name="unmatched-parameters",
        severity=Severity.WARNING,
        summary="A parameter file sets values for a node that the system does not have.",
        why=(
            "Parameter files use the full ROS names of nodes, including the namespace. Values "
            "under any other name are ignored, and the node keeps its defaults."
        ),
        bad="""\
# file: system.yaml
system: parameters
parameter_files: [robot.yaml]
nodes:
  motor: {namespace: control, parameters: {speed: {type: double, default: 1.0}}}
# file: robot.yaml
/motor: {ros__parameters: {speed: 2.0}}
""",
        good="""\
# file: system.yaml
system: parameters
parameter_files: [robot.yaml]
nodes:
  motor: {namespace: control, parameters: {speed: {type: double, default: 1.0}}}
# file: robot.yaml
/control/motor: {ros__parameters: {speed: 2.0}}
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the node names in parameter files."""
    names = [node.full_name for node in context.system.nodes]
    for name in context.system.unmatched_parameters if not context.is_partial else ():
        yield Diagnostic(
            RULE,
            f"no node of this system is named '{name}'",
            name.span,
            hint=suggestion(name.value, names),
        )
