"""Dependencies between nodes, nodes that are watched for silence, and restarts."""

from __future__ import annotations

from collections.abc import Iterator

from composer.base.diagnostics import Diagnostic, Label, error, suggestion, warning
from composer.base.source import Located, Span
from composer.model import (
    Node,
    OnFailure,
    PortKind,
    PortOfNode,
    PrimaryState,
    RestartBudget,
    Supervision,
    System,
)
from composer.model.dependencies import dependency_cycles
from composer.rules.analysis.context import Context, is_unresolved
from composer.rules.analysis.formatting import cycle_of, number
from composer.rules.analysis.rates import timed_publishers
from composer.rules.analysis.subjects import PORT_SECTIONS, earlier_errors

START_ORDER = warning("RC402", "start-order")
IMPOSSIBLE_WATCH = error("RC404", "impossible-watch")
_RANK = {PrimaryState.UNCONFIGURED: 0, PrimaryState.INACTIVE: 1, PrimaryState.ACTIVE: 2}
FAILURE_SETTINGS = warning("RC406", "failure-settings")


def check_dependency_cycle(context: Context) -> Iterator[Diagnostic]:
    """Report one cycle for every group of nodes that depend on each other."""
    hints = ("remove the dependency", "remove one of the dependencies")
    for names in dependency_cycles(context.system):
        pairs = zip(names, (*names[1:], names[0]), strict=True)
        links = [(name, _dependency(context.system, name, other)) for name, other in pairs]
        yield cycle_of("node", ("depends on", "depend on"), links, hints)


def _dependency(system: System, name: str, other: str) -> Located[str]:
    node = system.node(name)
    found = node.depends_on if node is not None else ()
    return next(item.node for item in found if item.node.value == other)


def check_dependency_not_reached(context: Context) -> Iterator[Diagnostic]:
    """Compare the required states with the states that the bring-up reaches."""
    system = context.system
    for node in system.nodes:
        for dependency in node.depends_on:
            other = system.node(dependency.node.value)
            if (
                other is None
                or other is node
                or _start_rank(system, node) < _RANK[dependency.state]
            ):
                continue
            if other.autostart is not None and _start_rank(system, other) < _RANK[dependency.state]:
                yield Diagnostic(
                    START_ORDER,
                    f"node '{node.name}' needs '{other.name}' to be {dependency.state}, "
                    f"but '{other.name}' autostarts only to {other.autostart}",
                    dependency.node.span,
                    (Label(other.autostart.span, "stays here until moved manually"),),
                    _autostart_hint(other.autostart.value),
                )


def _start_rank(system: System, node: Node) -> int:
    """Return the rank of the state that the bring-up moves a node to, dependencies permitting."""
    own = node.autostart.value if node.autostart is not None else system.autostart
    return min(_RANK[own], _RANK[system.autostart])


def _autostart_hint(reached: PrimaryState) -> str:
    if reached is PrimaryState.UNCONFIGURED:
        return "raise its autostart, or remove the dependency"
    return f"raise its autostart, or depend on it being {reached}"


def check_unknown_watched_publisher(context: Context) -> Iterator[Diagnostic]:
    """Compare the watched publishers with the declared ones."""
    errors = context.once(earlier_errors)
    for node in context.system.nodes:
        if not node.complete or errors.may_declare(node.name.value, *PORT_SECTIONS):
            continue
        known = [port.name.value for port in node.ports_of(PortKind.PUBLISHER)]
        for name, _ in node.supervision.watch.topics:
            if name.value not in known and not is_unresolved(name.value):
                yield Diagnostic(
                    IMPOSSIBLE_WATCH,
                    f"node '{node.name}' has no publisher '{name}' to watch",
                    name.span,
                    hint=suggestion(name.value, known),
                )


def check_nothing_to_watch(context: Context) -> Iterator[Diagnostic]:
    """Check every node that is watched as a whole."""
    errors = context.once(earlier_errors)
    for node in context.system.nodes:
        limit = node.supervision.watch.silence_ms
        if limit is None or not node.complete or node.ports_of(PortKind.PUBLISHER):
            continue
        if errors.may_declare(node.name.value, *PORT_SECTIONS):
            continue
        yield Diagnostic(
            IMPOSSIBLE_WATCH,
            f"node '{node.name}' is watched for silence, but has no publishers",
            limit.span,
            hint="watch the nodes that publish its input, or set 'callback_ms'",
        )


def check_silence_too_short(context: Context) -> Iterator[Diagnostic]:
    """Compare the watched limits with the periods of the publishing timers."""
    periods: dict[str, dict[str, tuple[PortOfNode, float]]] = {}
    for endpoint, period_s in context.once(timed_publishers):
        of_node = periods.setdefault(endpoint.node.name.value, {})
        of_node[endpoint.port.name.value] = (endpoint, period_s)
    for node in context.system.nodes:
        known = periods.get(node.name.value, {})
        watch = node.supervision.watch
        for name, limit in watch.topics:
            if name.value in known:
                yield from _compare_silence(limit, *known[name.value])
        publishers = node.ports_of(PortKind.PUBLISHER)
        if watch.silence_ms is not None and known and len(known) == len(publishers):
            fastest = min(known.values(), key=lambda item: item[1])
            yield from _compare_silence(watch.silence_ms, *fastest)


def _compare_silence(
    limit: Located[float], endpoint: PortOfNode, period_s: float
) -> Iterator[Diagnostic]:
    period_ms = period_s * 1000.0
    deadline_ms = endpoint.port.qos.profile.deadline_ms
    if limit.value > period_ms or (deadline_ms is not None and deadline_ms < period_ms):
        return  # a deadline shorter than the period is reported instead
    yield Diagnostic(
        IMPOSSIBLE_WATCH,
        f"node '{endpoint.node.name}' counts as silent after {number(limit.value)} ms, "
        f"but publishes '{endpoint.port.name}' every {number(period_ms)} ms",
        limit.span,
        (Label(endpoint.port.name.span, "the watched publisher"),),
        f"allow for late messages, for example {number(3 * period_ms)}",
    )


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
