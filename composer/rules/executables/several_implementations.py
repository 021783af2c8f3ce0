"""A node with more than one implementation."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, Label, error

RULE = error(
    code="RC470",
    name="several-implementations",
    summary="A node has more than one of behavior, class and executable.",
    why="Only one of them can be the node. What each of them offers is declared by the ports.",
    bad="""\
# file: system.yaml
system: lights
nodes:
  lamp:
    behavior: lamp:Lamp
    executable: {command: [sh, driver.sh]}
# file: lamp.py
class Lamp:
    pass
# file: driver.sh
exec driver
""",
    good="""\
# file: system.yaml
system: lights
nodes:
  lamp:
    executable: {command: [sh, driver.sh]}
# file: driver.sh
exec driver
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check that every node has at most one implementation."""
    for node in context.system.nodes:
        for key in node.conflicting[1:]:
            first = node.conflicting[0]
            yield Diagnostic(
                RULE,
                f"node '{node.name}' has '{key}' in addition to '{first}'",
                key.span,
                related=(Label(first.span, f"'{first}'"),),
                hint="keep one of them",
            )
