"""How often timers fire, as far as the model tells."""

from __future__ import annotations

import math

from composer.expressions import EvaluationError, Expression
from composer.model import Node, Timer


def period_value(node: Node, timer: Timer) -> float | None:
    """Return the number a timer's period is given as, in its own unit.

    An expression is worked out with the values the parameters start with. None when that is not
    possible, or gives no number.
    """
    value = timer.period.value
    if isinstance(value, Expression):
        try:
            value = value.evaluate({"parameters": start_values(node)})
        except EvaluationError:
            return None
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value)


def period_seconds(node: Node, timer: Timer) -> float | None:
    """Return a timer's period in seconds; None when it is not known or not a sensible one."""
    value = period_value(node, timer)
    if value is None or not math.isfinite(value) or value <= 0:
        return None
    return timer.period.seconds(value)


def start_values(node: Node) -> dict[str, object]:
    """Return the parameters that have a value, as expressions see them."""
    values: dict[str, object] = {}
    for parameter in node.parameters:
        if parameter.value is not None:
            values[parameter.name.value] = parameter.value.value
    return values
