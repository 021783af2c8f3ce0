"""A required parameter without a value."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.earlier_errors import earlier_errors
from composer.diagnostics import Diagnostic, Label, error, nearest

RULE = error(
    code="RC424",
    name="missing-parameter",
    summary="A parameter without a default has no value.",
    why="A parameter without a default is required: the node cannot run without a value.",
    bad="""\
system: parameters
nodes:
  camera:
    parameters: {serial_number: {type: string}}
""",
    good="""\
system: parameters
nodes:
  camera:
    parameters: {serial_number: {type: string, default: A-1047}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check for parameters without a value. A node type alone does not need them."""
    if context.system.node_type:
        return
    errors = context.once(earlier_errors)
    for node in context.system.nodes:
        if errors.may_declare(node.name.value, "parameters"):
            continue
        unknown = [item.name.value for item in node.unknown if item.section == "parameters"]
        for parameter in node.parameters:
            if parameter.value is None:
                if nearest(parameter.name.value, unknown) is not None:
                    continue  # it is probably set, with a misspelled name
                yield Diagnostic(
                    RULE,
                    f"node '{node.name}' needs a value for parameter '{parameter.name}'",
                    node.name.span,
                    (Label(parameter.name.span, "declared without a default"),),
                    f"add 'parameters: {{{parameter.name}: ...}}' to the node",
                )
