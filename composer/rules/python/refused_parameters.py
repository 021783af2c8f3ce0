"""Values of parameters for which a behavior refuses to be configured."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behavior_code import diagnostics_of
from composer.behavior_checks import Kind
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC489",
        name="refused-parameters",
        severity=Severity.WARNING,
        summary="'on_configure' of a behavior raises for the values of the parameters.",
        why=(
            "The node cannot be configured with these values, so the bring-up is rolled back. They "
            "may still be changed before, by 'compose param set' for a node that waits for it."
        ),
        bad="""\
# file: system.yaml
system: behavior
nodes:
  counter:
    behavior: counter:Counter
    parameters:
      lowest: {type: integer, default: 10}
      highest: {type: integer, default: 5}
# file: counter.py
class Counter:
    def on_configure(self):
        if self.parameters.lowest > self.parameters.highest:
            raise ValueError("lowest must not be above highest")
""",
        good="""\
# file: system.yaml
system: behavior
nodes:
  counter:
    behavior: counter:Counter
    parameters:
      lowest: {type: integer, default: 1}
      highest: {type: integer, default: 5}
# file: counter.py
class Counter:
    def on_configure(self):
        if self.parameters.lowest > self.parameters.highest:
            raise ValueError("lowest must not be above highest")
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Report the conditions that raise for the values that the nodes have."""
    yield from diagnostics_of(context, Kind.REFUSED, RULE)
