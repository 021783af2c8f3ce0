"""Parameters for a node that is not there."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, Rule, Severity, register, suggestion

RULE = register(
    Rule(
        code="RC246",
        name="unmatched-parameters",
        severity=Severity.WARNING,
        summary="A parameter file has values for a node that the system does not have.",
        why=(
            "The names in a parameter file are those that nodes have in ROS, namespace and all. "
            "Values under any other name are read by nobody, and the node keeps its defaults."
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
    """Look at the names in parameter files that are no node's."""
    names = [node.full_name for node in context.system.nodes]
    for name in context.system.unmatched_parameters if not context.is_partial else ():
        yield Diagnostic(
            RULE,
            f"no node of this system is called '{name}'",
            name.span,
            hint=suggestion(name.value, names),
        )
