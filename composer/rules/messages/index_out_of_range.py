"""An expression with an index beyond the end of an array parameter."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.messages.expressions import ExpressionSite, expression_sites
from composer.analysis.spans import part_of_path
from composer.diagnostics import Diagnostic, Label, warning
from composer.expressions import FieldPath

RULE = warning(
    code="RC308",
    name="index-out-of-range",
    summary="An element of a list or an array parameter is read that does not exist.",
    why=(
        "Reading it fails, unless a parameter is set to a longer array "
        "while the node runs. Indices count from 0."
    ),
    bad="""\
system: indices
nodes:
  robot:
    parameters: {goal: {type: double_array, default: [1.0, 2.0]}}
    on_activate: {log: "driving to y = {parameters.goal[2]}"}
""",
    good="""\
system: indices
nodes:
  robot:
    parameters: {goal: {type: double_array, default: [1.0, 2.0]}}
    on_activate: {log: "driving to y = {parameters.goal[1]}"}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the indices in expressions with the initial values of the parameters."""
    for site in context.once(expression_sites):
        for path in site.expression.paths:
            yield from _path(site, path)


def _path(site: ExpressionSite, path: FieldPath) -> Iterator[Diagnostic]:
    if path.root != "parameters" or len(path.parts) != 3:
        return
    name, index = str(path.parts[1]), path.parts[2]
    parameter = site.node.parameter(name)
    if parameter is None or parameter.value is None or not isinstance(index, int):
        return
    value = parameter.value.value
    if isinstance(value, list) and not -len(value) <= index < len(value):
        count = f"{len(value)} element" + ("" if len(value) == 1 else "s")
        yield Diagnostic(
            RULE,
            f"parameter '{name}' has no element {index}: it has {count}",
            part_of_path(site.span, site.expression, path, 2),
            (Label(parameter.value.span, "its value"),),
            f"indices count from 0, so the last one is {len(value) - 1}" if value else None,
        )
