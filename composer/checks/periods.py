"""How often timers fire and ports publish, as far as the model tells."""

from __future__ import annotations

import math
from collections.abc import Iterator

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
    """Return the parameters that have a value, as expressions see them: dots are levels."""
    values: dict[str, object] = {}
    for parameter in node.parameters:
        if parameter.value is not None:
            values[parameter.name.value] = parameter.value.value
    return values


def publishing_periods(node: Node) -> Iterator[tuple[str, float]]:
    """Yield port and period in seconds of everything a timer publishes in YAML.

    A port that something else publishes through too is left out: its rate is not known.
    """
    periods: dict[str, list[float | None]] = {}
    for timer in node.timers:
        if timer.reaction is not None:
            for send in timer.reaction.publish:
                known = period_seconds(node, timer)
                periods.setdefault(send.port.value, []).append(known)
    others = [reaction for _, reaction in node.reactions]
    others += [reaction for port in node.ports for _, reaction in port.reactions]
    elsewhere = {send.port.value for reaction in others for send in reaction.publish}
    for name, found in periods.items():
        known_periods = [period for period in found if period is not None]
        if name not in elsewhere and len(known_periods) == len(found):
            yield name, min(known_periods)
