"""Timers and their periods."""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator

from composer.base.diagnostics import Diagnostic, Label, error, info, suggestion, warning
from composer.language.expressions import Expression
from composer.model import Node, Parameter, PeriodError, PeriodUnit, Timer
from composer.rules.analysis.context import Context
from composer.rules.analysis.formatting import number
from composer.rules.analysis.subjects import used_parameters
from composer.rules.references import UNDECLARED_NAME

TIMER_PERIOD = error("RC411", "timer-period")
UNUSUAL_RATE = info("RC412", "unusual-rate")
UNLIKELY_UNIT = warning("RC533", "unlikely-unit")


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


_SHORTEST_S = 0.0001
_LONGEST_S = 86_400.0


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


#: Units of time and rate, as parameters declare them or end with.
_UNITS = ("Hz", "ms", "s", "us", "ns")
_EXPECTED_UNITS = {PeriodUnit.MILLISECONDS: "ms", PeriodUnit.HERTZ: "Hz"}
_UNIT_HINTS = {
    ("Hz", PeriodUnit.MILLISECONDS): "write 'rate_hz' instead of 'period_ms'",
    ("ms", PeriodUnit.HERTZ): "write 'period_ms' instead of 'rate_hz'",
    ("s", PeriodUnit.MILLISECONDS): "multiply it by 1000.0",
    ("s", PeriodUnit.HERTZ): "write 'period_ms' instead of 'rate_hz', and multiply it by 1000.0",
}


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


#: Lowest and highest usual rate in hertz, by a level of the namespace.
_BANDS_HZ = {"control": (50.0, 500.0), "perception": (10.0, 30.0)}
#: How far a rate is from its band, as a factor, before it is reported: working systems differ, and
#: a period in another unit differs by more.
_TOLERANCE = 10.0


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
