"""Restart settings that have no effect."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, warning
from composer.model import OnFailure, Supervision
from composer.source import Span

RULE = warning(
    code="RC407",
    name="unused-restart",
    summary="restart is set, but failed nodes are not restarted.",
    why="Without 'on_failure: restart', a failed node stays down, and 'restart' has no effect.",
    bad="""\
system: restarting
nodes:
  lidar:
    on_activate: {log: started}
    lifecycle: {restart: {max_attempts: 3}}
""",
    good="""\
system: restarting
nodes:
  lidar:
    on_activate: {log: started}
    lifecycle: {on_failure: restart, restart: {max_attempts: 3}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check for restart budgets that no node uses."""
    system = context.system
    declared: dict[Span, None] = {}
    used: set[Span] = set()
    for supervision in (system.supervision, *(node.supervision for node in system.nodes)):
        span = supervision.restart.span
        if span is not None:
            declared[span] = None
    for node in system.nodes:
        span = node.supervision.restart.span
        if span is not None and _uses(node.supervision):
            used.add(span)
    for span in declared:
        if span not in used:
            yield Diagnostic(
                RULE,
                "the restart settings have no effect",
                span,
                hint="add 'on_failure: restart'",
            )


def _uses(supervision: Supervision) -> bool:
    """Return whether the settings have an effect; errors are counted within their window, too."""
    counts_errors = supervision.watch.max_errors is not None and supervision.restart.has_window
    return supervision.policy is OnFailure.RESTART or counts_errors
