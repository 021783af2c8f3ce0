"""A restart budget that can never be exhausted."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import number
from composer.diagnostics import Diagnostic, warning
from composer.model import OnFailure, RestartBudget
from composer.source import Span

RULE = warning(
    code="RC406",
    name="endless-restart",
    summary=(
        "The backoff of the restarts adds up to more than the window in which restarts are counted."
    ),
    why=(
        "By the last attempt, the first one is no longer counted, so a node that always fails "
        "is restarted forever."
    ),
    bad="""\
system: restarting
nodes:
  lidar:
    on_activate: {log: started}
    lifecycle:
      on_failure: restart
      restart: {max_attempts: 5, window_ms: 10000, backoff_ms: 1000}
""",
    good="""\
system: restarting
nodes:
  lidar:
    on_activate: {log: started}
    lifecycle:
      on_failure: restart
      restart: {max_attempts: 5, window_ms: 60000, backoff_ms: 1000}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check every restart budget that is in use, once."""
    seen: set[Span] = set()
    for node in context.system.nodes:
        budget = node.supervision.restart
        if node.supervision.policy is not OnFailure.RESTART or budget.span is None:
            continue
        total_ms = _total_backoff_ms(budget)
        if total_ms < budget.window_ms or budget.span in seen:
            continue
        seen.add(budget.span)
        yield Diagnostic(
            RULE,
            f"{budget.max_attempts} restarts take at least {number(total_ms)} ms, "
            f"but only restarts within {number(budget.window_ms)} ms are counted",
            budget.span,
            hint="increase 'window_ms', or reduce 'max_attempts' or the backoff",
        )


def _total_backoff_ms(budget: RestartBudget) -> float:
    """Return the shortest time from the first restart to the last.

    The backoff is constant from some attempt on, so the loop is short for any budget.
    """
    total_s = 0.0
    for attempt in range(1, budget.max_attempts):
        wait_s = budget.backoff_s(attempt)
        if wait_s == budget.backoff_s(attempt + 1):
            return 1000.0 * (total_s + wait_s * (budget.max_attempts - attempt))
        total_s += wait_s
    return 1000.0 * total_s
