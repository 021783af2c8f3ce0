"""A behavior whose class is not defined in its module."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.behaviors import behaviors
from composer.analysis.context import Context
from composer.analysis.spans import part_of
from composer.diagnostics import Diagnostic, Rule, Severity, register, suggestion

RULE = register(
    Rule(
        code="RC432",
        name="behavior-class-missing",
        severity=Severity.ERROR,
        summary="The module of a behavior does not define a class of that name.",
        why="The node cannot be created without the class.",
        bad="""\
# file: system.yaml
system: behavior
nodes:
  planner: {behavior: planner:Planer}
# file: planner.py
class Planner:
    pass
""",
        good="""\
# file: system.yaml
system: behavior
nodes:
  planner: {behavior: planner:Planner}
# file: planner.py
class Planner:
    pass
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check that the module of every behavior defines its class."""
    for _, source in context.once(behaviors):
        if not source.module_found or source.class_found or source.problem is not None:
            continue
        if source.path is None:
            continue  # the contents of a compiled module cannot be read
        reference = source.reference
        yield Diagnostic(
            RULE,
            f"module '{reference.module}' has no class '{reference.class_name}'",
            part_of(reference.text, len(reference.module) + 1, len(reference.class_name)),
            hint=suggestion(reference.class_name, source.class_names),
        )
