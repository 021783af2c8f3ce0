"""A node with more than one implementation."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register
from composer.model import Node
from composer.source import Span

RULE = register(
    Rule(
        code="RC470",
        name="several-implementations",
        severity=Severity.ERROR,
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
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check that every node has at most one implementation."""
    for node in context.system.nodes:
        first, *others = _implementations(node) or [("", node.span)]
        for name, span in others:
            yield Diagnostic(
                RULE,
                f"node '{node.name}' has '{name}' in addition to '{first[0]}'",
                span,
                related=(Label(first[1], f"'{first[0]}'"),),
                hint="keep one of them",
            )


def _implementations(node: Node) -> list[tuple[str, Span]]:
    found: list[tuple[str, Span]] = []
    if node.behavior is not None:
        found.append(("behavior", node.behavior.text.span))
    if node.hosted_class is not None:
        found.append(("class", node.hosted_class.reference.text.span))
    if node.executable is not None:
        found.append(("executable", node.executable.span))
    return found
