"""A behavior module that does not exist or cannot be read."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behaviors import behaviors
from composer.analysis.spans import part_of
from composer.behavior_source import nearby_modules
from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.project import Project

RULE = register(
    Rule(
        code="RC431",
        name="behavior-module-missing",
        severity=Severity.ERROR,
        summary="The Python module of a behavior does not exist or cannot be parsed.",
        why=(
            "The module is searched for next to the YAML file, in the project's nodes/ folder, "
            "and on Python's module search path. It is parsed, not imported."
        ),
        bad="""\
# file: system.yaml
system: behavior
nodes:
  planner: {behavior: plannr:Planner}
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
    """Check that the module of every behavior exists and can be read."""
    for _, source in context.once(behaviors):
        reference = source.reference
        span = part_of(reference.text, 0, len(reference.module))
        if not source.module_found:
            project = Project.at(reference.folder)
            nearby = nearby_modules(reference.module, reference.folder, project)
            yield Diagnostic(
                RULE,
                f"no Python module named '{reference.module}'",
                span,
                hint=nearby.hint
                or f"expected {reference.module.replace('.', '/')}.py next to the YAML file",
            )
        elif source.problem is not None and source.problem_span is None:
            yield Diagnostic(RULE, f"module '{reference.module}' {source.problem}", span)
