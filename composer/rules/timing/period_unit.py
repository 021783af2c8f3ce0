"""A period that is a parameter in another unit."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, Label, warning
from composer.expressions import Expression
from composer.model import Node, Parameter, PeriodUnit, Timer

RULE = warning(
    code="RC535",
    name="period-unit",
    summary="A period in milliseconds, or a rate in hertz, is a parameter in another unit.",
    why="The timer fires at another rate than the parameter says: 20 Hz is not 20 ms.",
    bad="""\
system: units
nodes:
  motor:
    parameters: {rate_hz: 20.0}
    timers: {step: {period_ms: "{parameters.rate_hz}", log: step}}
""",
    good="""\
system: units
nodes:
  motor:
    parameters: {rate_hz: 20.0}
    timers: {step: {rate_hz: "{parameters.rate_hz}", log: step}}
""",
)

#: Units of time and rate, as parameters declare them or end with.
_UNITS = ("Hz", "ms", "s", "us", "ns")
_EXPECTED = {PeriodUnit.MILLISECONDS: "ms", PeriodUnit.HERTZ: "Hz"}
_HINTS = {
    ("Hz", PeriodUnit.MILLISECONDS): "write 'rate_hz' instead of 'period_ms'",
    ("ms", PeriodUnit.HERTZ): "write 'period_ms' instead of 'rate_hz'",
    ("s", PeriodUnit.MILLISECONDS): "multiply it by 1000.0",
    ("s", PeriodUnit.HERTZ): "write 'period_ms' instead of 'rate_hz', and multiply it by 1000.0",
}


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the timers whose period is a parameter and nothing else."""
    for node in context.system.nodes:
        for timer in node.timers:
            parameter = _parameter(node, timer)
            unit = _unit(parameter) if parameter is not None else None
            period = timer.period
            if parameter is None or unit in (None, _EXPECTED[period.unit]):
                continue
            yield Diagnostic(
                RULE,
                f"'{period.unit}' of timer '{timer.name}' is parameter '{parameter.name}', "
                f"which is in {unit}",
                period.span,
                (Label(parameter.name.span, "the parameter"),),
                _HINTS.get((unit or "", period.unit), f"convert it to {_EXPECTED[period.unit]}"),
            )


def _parameter(node: Node, timer: Timer) -> Parameter | None:
    """Return the parameter that a period consists of, or None."""
    value = timer.period.value
    if not isinstance(value, Expression) or not isinstance(value.tree, ast.Attribute):
        return None
    [path] = value.paths
    return node.parameter(".".join(map(str, path.parts[1:])))


def _unit(parameter: Parameter) -> str | None:
    """Return the unit of a parameter: the declared one, or that in its name."""
    if parameter.unit:
        return parameter.unit if parameter.unit in _UNITS else None
    _, _, suffix = parameter.name.value.rpartition("_")
    return next((unit for unit in _UNITS if unit.lower() == suffix), None)
