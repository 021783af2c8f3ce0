"""Timers and chains of publishers: their periods, and the delays along them."""

from __future__ import annotations

import ast
import math
from collections.abc import Iterable, Iterator
from itertools import pairwise

from composer.base.diagnostics import Diagnostic, Label, Subject, error, info, suggestion, warning
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.language.expressions import Expression
from composer.model import (
    Chain,
    Node,
    Parameter,
    PeriodError,
    PeriodUnit,
    Port,
    PortKind,
    System,
    Timer,
)
from composer.rules.analysis.context import Context
from composer.rules.analysis.formatting import number
from composer.rules.analysis.rates import causes
from composer.rules.analysis.subjects import NODES_OF_PROCESSES, used_parameters, wiring
from composer.rules.references import UNDECLARED_NAME

TIMER_PERIOD = error("RC411", "timer-period")
UNUSUAL_RATE = info("RC412", "unusual-rate")
UNLIKELY_UNIT = warning("RC533", "unlikely-unit")
_SHORTEST_S = 0.0001
_LONGEST_S = 86_400.0
#: Units of time and rate, as parameters declare them or end with.
_UNITS = ("Hz", "ms", "s", "us", "ns")
_EXPECTED_UNITS = {PeriodUnit.MILLISECONDS: "ms", PeriodUnit.HERTZ: "Hz"}
_UNIT_HINTS = {
    ("Hz", PeriodUnit.MILLISECONDS): "write 'rate_hz' instead of 'period_ms'",
    ("ms", PeriodUnit.HERTZ): "write 'period_ms' instead of 'rate_hz'",
    ("s", PeriodUnit.MILLISECONDS): "multiply it by 1000.0",
    ("s", PeriodUnit.HERTZ): "write 'period_ms' instead of 'rate_hz', and multiply it by 1000.0",
}
#: Lowest and highest usual rate in hertz, by a level of the namespace.
_BANDS_HZ = {"control": (50.0, 500.0), "perception": (10.0, 30.0)}
#: How far a rate is from its band, as a factor, before it is reported: working systems differ, and
#: a period in another unit differs by more.
_TOLERANCE = 10.0
IMPOSSIBLE_CHAIN = error("RC415", "impossible-chain")
UNMEASURED_CHAIN = warning("RC477", "unmeasured-chain")


def check_unknown_timer(context: Context) -> Iterator[Diagnostic]:
    """Check the timers that nodes override."""
    for node in context.system.nodes:
        for unknown in node.unknown:
            if unknown.section == "timers":
                yield Diagnostic(
                    UNDECLARED_NAME,
                    f"node type '{node.type_name}' has no timer '{unknown.name}'",
                    unknown.name.span,
                    hint=suggestion(unknown.name.value, unknown.known),
                )


def check_timer_period(context: Context) -> Iterator[Diagnostic]:
    """Check every timer whose period is known."""
    for node in context.system.nodes:
        for timer in node.timers:
            problem = _period_problem(node, timer)
            if problem is not None:
                yield Diagnostic(
                    TIMER_PERIOD,
                    f"timer '{timer.name}' {problem}{_origin_text(timer)}",
                    timer.period.span,
                    hint="use a period between 0.1 ms and one day",
                    relies_on=used_parameters(timer.period.value),
                )


def _period_problem(node: Node, timer: Timer) -> str | None:
    period = timer.period
    try:
        value = period.evaluate(node.initial_parameters)
    except PeriodError:
        return None  # the expression is reported by the rules for expressions and parameters
    if not math.isfinite(value):
        return f"has a {period.unit} that is not finite"
    period_s = node.period_s(timer)
    if value <= 0 or period_s is None:
        return f"has a {period.unit} of {number(value)}, which is not positive"
    unit = "ms" if period.unit is PeriodUnit.MILLISECONDS else "Hz"
    if period_s < _SHORTEST_S:
        return f"fires every {number(period_s * 1e6)} us ({number(value)} {unit}), too fast to keep"
    if period_s > _LONGEST_S:
        return f"fires every {number(period_s / 3600)} h ({number(value)} {unit}), too rarely"
    return None


def _origin_text(timer: Timer) -> str:
    """Return which values an expression was evaluated with."""
    value = timer.period.value
    if not isinstance(value, Expression) or not value.paths:
        return ""
    return ", with the initial parameters"


def check_period_unit(context: Context) -> Iterator[Diagnostic]:
    """Check the timers whose period is a parameter and nothing else."""
    for node in context.system.nodes:
        for timer in node.timers:
            parameter = _period_parameter(node, timer)
            unit = _parameter_unit(parameter) if parameter is not None else None
            period = timer.period
            if parameter is None or unit in (None, _EXPECTED_UNITS[period.unit]):
                continue
            yield Diagnostic(
                UNLIKELY_UNIT,
                f"'{period.unit}' of timer '{timer.name}' is parameter '{parameter.name}', "
                f"which is in {unit}",
                period.span,
                (Label(parameter.name.span, "the parameter"),),
                _UNIT_HINTS.get(
                    (unit or "", period.unit), f"convert it to {_EXPECTED_UNITS[period.unit]}"
                ),
            )


def _period_parameter(node: Node, timer: Timer) -> Parameter | None:
    """Return the parameter that a period consists of, or None."""
    value = timer.period.value
    if not isinstance(value, Expression) or not isinstance(value.tree, ast.Attribute):
        return None
    [path] = value.paths
    return node.parameter(".".join(map(str, path.parts[1:])))


def _parameter_unit(parameter: Parameter) -> str | None:
    """Return the unit of a parameter: the declared one, or that in its name."""
    if parameter.unit:
        return parameter.unit if parameter.unit in _UNITS else None
    _, _, suffix = parameter.name.value.rpartition("_")
    return next((unit for unit in _UNITS if unit.lower() == suffix), None)


def check_unusual_rate(context: Context) -> Iterator[Diagnostic]:
    """Check the fastest timer of each node; slower timers do housekeeping."""
    for node in context.system.nodes:
        levels = set(node.namespace.value.split("/"))
        for word, band in _BANDS_HZ.items():
            fastest = _fastest_timer(node) if word in levels else None
            if fastest is not None:
                yield from _unusual_rate(*fastest, word, band)


def _fastest_timer(node: Node) -> tuple[Timer, float] | None:
    """Return the fastest timer with its rate in hertz."""
    known = ((timer, node.period_s(timer)) for timer in node.timers)
    rates = [(timer, 1.0 / period_s) for timer, period_s in known if period_s is not None]
    return max(rates, key=lambda found: found[1], default=None)


def _unusual_rate(
    timer: Timer, rate_hz: float, word: str, band: tuple[float, float]
) -> Iterator[Diagnostic]:
    low_hz, high_hz = band
    if low_hz / _TOLERANCE <= rate_hz <= high_hz * _TOLERANCE:
        return
    yield Diagnostic(
        UNUSUAL_RATE,
        f"timer '{timer.name}' of a {word} node runs at {number(rate_hz)} Hz; "
        f"{number(low_hz)} to {number(high_hz)} Hz is usual",
        timer.period.span,
        relies_on=used_parameters(timer.period.value),
    )


@dataclass(frozen=True, slots=True)
class ChainDelay:
    """A delay in a chain: its cause, its length and where it is declared."""

    what: str
    milliseconds: float
    span: Span
    is_period: bool = False


def input_ports(node: Node, topic: str) -> Iterator[Port]:
    """Yield the subscriptions of a node to a topic."""
    for port in node.ports_of(PortKind.SUBSCRIPTION):
        if port.full_name == topic:
            yield port


def chain_delays(context: Context, chain: Chain) -> Iterator[ChainDelay]:
    """Yield the delays after the first publisher of a chain.

    A node that publishes from a subscription takes up to the budget of that callback. A node that
    publishes from a timer delays data by up to the timer's period.
    """
    for before, after in pairwise(chain.through):
        port, node = context.system.port(before), context.system.node(after.node)
        if port is None or node is None:
            continue
        of_port = context.once(causes).get((after.node, after.port), ())
        received = {item.name.value for item in input_ports(node, port.full_name)}
        republishing = [
            item.port for item in of_port if item.port and item.port.name.value in received
        ]
        timers = [item.timer for item in of_port if item.timer is not None]
        if republishing:
            yield from _budget_delay(f"{node.name}.{republishing[0].name}", republishing[0])
        elif timers and len(timers) == len(of_port):
            yield from _timer_delay(node, timers)


def _timer_delay(node: Node, timers: list[Timer]) -> Iterator[ChainDelay]:
    """Yield the delay of the fastest timer."""
    known = [(node.period_s(timer), timer) for timer in timers]
    periods = [(period_s, timer) for period_s, timer in known if period_s is not None]
    if not periods:
        return
    period_s, timer = min(periods, key=lambda item: item[0])
    name = f"{node.name}.{timer.name}"
    yield ChainDelay(f"{name} fires every", period_s * 1000.0, timer.period.span, is_period=True)
    yield from _budget_delay(name, timer)


def _budget_delay(name: str, callback: Port | Timer) -> Iterator[ChainDelay]:
    budget_ms = callback.budget_ms
    if budget_ms is not None:
        yield ChainDelay(f"{name} may take", budget_ms.value, budget_ms.span)


def _wiring_of_chain(system: System, chain: Chain) -> tuple[Subject, ...]:
    ends = [(system.node(end.node), system.port(end)) for end in chain.through]
    known = [(node, port) for node, port in ends if node is not None and port is not None]
    return tuple(subject for node, port in known for subject in wiring(node, port))


def check_broken_chain(context: Context) -> Iterator[Diagnostic]:
    """Check each pair of consecutive ports in every chain."""
    system = context.system
    for chain in system.chains:
        for before, after in pairwise(chain.through):
            port, node = system.port(before), system.node(after.node)
            if port is None or port.kind is not PortKind.PUBLISHER:
                continue
            following = system.port(after)
            if node is None or not node.complete or following is None:
                continue
            if following.kind is not PortKind.PUBLISHER:
                continue
            if not any(input_ports(node, port.full_name)):
                yield Diagnostic(
                    IMPOSSIBLE_CHAIN,
                    f"node '{node.name}' does not subscribe to '{port.full_name}', "
                    f"which '{before.text}' publishes",
                    after.text.span,
                    (Label(before.text.span, "the previous publisher"),),
                    f"subscribe '{node.name}' to it, or add the missing publishers to the chain",
                    relies_on=_wiring_of_chain(system, chain),
                )
                break  # further gaps often follow from the first one


def check_latency_budget(context: Context) -> Iterator[Diagnostic]:
    """Add up the delays along every chain."""
    for chain in context.system.chains:
        found = list(chain_delays(context, chain))
        total_ms = sum(delay.milliseconds for delay in found)
        if total_ms > chain.latency_ms.value:
            yield Diagnostic(
                IMPOSSIBLE_CHAIN,
                f"chain '{chain.name}' may take {number(total_ms)} ms, "
                f"more than its latency of {number(chain.latency_ms.value)} ms",
                chain.latency_ms.span,
                tuple(
                    Label(delay.span, f"{delay.what} {number(delay.milliseconds)} ms")
                    for delay in found
                ),
                _latency_hint(found),
            )


def _latency_hint(delays: Iterable[ChainDelay]) -> str:
    """Return a hint about what the delays are: periods of timers, budgets, or both."""
    kinds = {delay.is_period for delay in delays}
    if kinds == {True}:
        return "publish from the subscription, or use shorter timer periods"
    if kinds == {False}:
        return "use shorter budgets, or allow a higher latency"
    return "publish from the subscription, or use shorter timer periods or budgets"


def check_unmeasured_chain(context: Context) -> Iterator[Diagnostic]:
    """Check the publishers of the chains."""
    for chain in context.system.chains:
        ports = map(context.system.port, chain.through)
        if any(port is None or port.kind is not PortKind.PUBLISHER for port in ports):
            continue  # other rules report these
        nodes = ((endpoint, context.system.node(endpoint.node)) for endpoint in chain.through)
        known = [(endpoint, node) for endpoint, node in nodes if node is not None]
        for endpoint, node in known:
            if node.implementation.in_process and node.process == known[0][1].process:
                continue
            yield Diagnostic(
                UNMEASURED_CHAIN,
                f"the latency of chain '{chain.name}' is not measured: '{node.name}' runs in "
                "another process",
                endpoint.text.span,
                relies_on=(
                    NODES_OF_PROCESSES,
                    *(("process", str(item.process)) for _, item in known if item.process),
                ),
            )
            break
