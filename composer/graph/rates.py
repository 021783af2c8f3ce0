"""How often a node publishes, where its declaration says so."""

from __future__ import annotations

from composer.expressions import EvaluationError, Expression
from composer.model import Node, Period, Port, Timer


def timer_rate_hz(node: Node, timer: Timer) -> float | None:
    """Return the timer's rate with the parameters the node starts with; None if unknown."""
    value = _number(node, timer.period)
    if value is None or value <= 0.0:
        return None
    return 1.0 / timer.period.seconds(value)


def publishing_rate_hz(node: Node, port: Port) -> float | None:
    """Return the rate of the one timer that publishes to ``port`` each time it fires.

    None where a behaviour decides, where it depends on a condition, or where several do.
    """
    rates = [
        timer_rate_hz(node, timer)
        for timer in node.timers
        if timer.reaction is not None
        and timer.reaction.when is None
        and any(send.port.value == port.name.value for send in timer.reaction.publish)
    ]
    return rates[0] if len(rates) == 1 else None


def _number(node: Node, period: Period) -> float | None:
    value = period.value
    if isinstance(value, Expression):
        try:
            value = value.evaluate({"parameters": _parameters(node)})
        except EvaluationError:
            return None
    return float(value) if isinstance(value, int | float) else None


def _parameters(node: Node) -> dict[str, object]:
    return {
        parameter.name.value: parameter.value.value
        for parameter in node.parameters
        if parameter.value is not None
    }
