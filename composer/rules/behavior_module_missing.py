"""A behaviour in a module that is nowhere, or cannot be read."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.behaviors import behaviors
from composer.analysis.context import Context
from composer.analysis.places import part_of
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC431",
        name="behavior-module-missing",
        severity=Severity.ERROR,
        summary="The Python module of a behaviour is not found, or is not Python.",
        why=(
            "It is looked for beside the YAML file, in the project's nodes/, and where Python "
            "would find it. The module is read as text; nothing in it is run."
        ),
        bad="""\
# file: system.yaml
system: behaviour
nodes:
  planner: {behavior: plannr:Planner}
# file: planner.py
class Planner:
    pass
""",
        good="""\
# file: system.yaml
system: behaviour
nodes:
  planner: {behavior: planner:Planner}
# file: planner.py
class Planner:
    pass
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Look for the module of every behaviour."""
    for _, source in context.once(behaviors):
        reference = source.reference
        span = part_of(reference.text, 0, len(reference.module))
        if not source.module_found:
            yield Diagnostic(
                RULE,
                f"there is no Python module '{reference.module}'",
                span,
                hint=f"expected {reference.module.replace('.', '/')}.py beside the YAML file",
            )
        elif source.problem is not None:
            yield Diagnostic(RULE, f"module '{reference.module}' {source.problem}", span)
