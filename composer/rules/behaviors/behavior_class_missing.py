"""A behavior whose class is not defined in its module."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.analysis.endpoints.references import class_name_hint
from composer.analysis.python.behaviors import behaviors
from composer.analysis.spans import part_of
from composer.diagnostics import Diagnostic, Rule, Severity, register, suggestion
from composer.model import BehaviorReference

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
    """Check that every behavior names a class, and that its module defines it."""
    for node in context.system.nodes:
        if node.behavior is not None and not node.behavior.class_name:
            yield from _unnamed(node.behavior)
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


def _unnamed(reference: BehaviorReference) -> Iterator[Diagnostic]:
    text = reference.text.value
    if is_unresolved(text):
        return
    yield Diagnostic(
        RULE,
        f"behavior '{text}' names no class",
        reference.text.span,
        hint=class_name_hint(text),
    )
