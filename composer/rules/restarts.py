"""What happens when a node fails."""

from __future__ import annotations

from collections.abc import Iterator

from composer.base.diagnostics import Diagnostic, warning
from composer.base.source import Span
from composer.model import Node, OnFailure, RestartBudget, Supervision
from composer.rules.analysis.context import Context
from composer.rules.analysis.formatting import number

FAILURE_SETTINGS = warning("RC406", "failure-settings")


def check_endless_restart(context: Context) -> Iterator[Diagnostic]:
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
            FAILURE_SETTINGS,
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


def check_restart_delay(context: Context) -> Iterator[Diagnostic]:
    """Compare the delays of the system and of every node; shared settings are reported once."""
    system = context.system
    seen: set[Span] = set()
    for supervision in (system.supervision, *(node.supervision for node in system.nodes)):
        restart = supervision.restart
        span = restart.backoff_span
        if span is None or span in seen or restart.backoff_ms <= restart.backoff_max_ms:
            continue
        seen.add(span)
        yield Diagnostic(
            FAILURE_SETTINGS,
            f"restarts start with a delay of {number(restart.backoff_ms)} ms, longer than the "
            f"maximum of {number(restart.backoff_max_ms)} ms",
            span,
            hint="make 'backoff_max_ms' at least as long as 'backoff_ms'",
        )


def check_unused_restart(context: Context) -> Iterator[Diagnostic]:
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
        if span is not None and _uses_restart(node.supervision):
            used.add(span)
    for span in declared:
        if span not in used:
            yield Diagnostic(
                FAILURE_SETTINGS,
                "the restart settings have no effect",
                span,
                hint="add 'on_failure: restart'",
                relies_on=(("key", "on_failure"),),
            )


def _uses_restart(supervision: Supervision) -> bool:
    """Return whether the settings have an effect; errors are counted within their window, too."""
    counts_errors = supervision.watch.max_errors is not None and supervision.restart.has_window
    return supervision.policy is OnFailure.RESTART or counts_errors


def check_impossible_policy(context: Context) -> Iterator[Diagnostic]:
    """Check the policies that nodes set themselves."""
    system = context.system
    for node in system.nodes:
        policy = node.supervision.on_failure
        if policy is None or policy is system.supervision.on_failure:
            continue
        problem = _policy_problem(node)
        if problem is not None:
            yield Diagnostic(FAILURE_SETTINGS, problem[0], policy.span, hint=problem[1])


def _policy_problem(node: Node) -> tuple[str, str] | None:
    """Return what is wrong with the policy of a node, and what to do about it."""
    policy = node.supervision.policy
    if node.external is not None and policy is OnFailure.RESTART:
        hint = "remove it: with 'isolate', the node is used again once it is there again"
        return f"external node '{node.name}' cannot be restarted", hint
    if not node.required and policy is OnFailure.SHUTDOWN:
        hint = "remove 'required: false', or use 'isolate', 'restart' or 'ignore'"
        return f"node '{node.name}' is not required, so its failure ends nothing", hint
    return None
