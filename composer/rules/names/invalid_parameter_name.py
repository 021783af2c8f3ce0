"""A parameter name that tools cannot use."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.analysis.formatting import free_name, safe_name
from composer.diagnostics import Diagnostic, error
from composer.names import parameter_name_problem

RULE = error(
    code="RC224",
    name="invalid-parameter-name",
    summary="A parameter name does not consist of words separated by dots.",
    why=(
        "Parameter files, the command line and expressions can refer only to names that "
        "consist of letters, digits and underscores, separated by dots."
    ),
    bad="""\
system: names
nodes:
  motor:
    parameters: {max velocity: {type: double, default: 1.0}}
""",
    good="""\
system: names
nodes:
  motor:
    parameters: {max_velocity: {type: double, default: 1.0}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the name of every declared parameter. rcl passes any name on to other nodes."""
    for node in context.system.nodes:
        if node.gets_undeclared:
            continue
        names = {parameter.name.value for parameter in node.parameters}
        for parameter in node.parameters:
            name = parameter.name
            problem = parameter_name_problem(name.value)
            if problem is not None and not is_unresolved(name.value):
                better = ".".join(safe_name(part) for part in name.value.split(".") if part)
                yield Diagnostic(
                    RULE,
                    f"parameter name '{name}' {problem}",
                    name.span,
                    hint=f"rename it to '{free_name(better, names)}'",
                )
