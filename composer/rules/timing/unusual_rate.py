"""A rate that is unusual for the purpose of its node."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import number
from composer.diagnostics import Diagnostic, info
from composer.model import Node, Timer

RULE = info(
    code="RC412",
    name="unusual-rate",
    summary="A control or perception node runs at an unusual rate.",
    why=(
        "Control loops usually run at 50 to 500 Hz: slower loops are unstable, faster ones "
        "need a real-time system. Perception runs at 10 to 30 Hz, limited by sensors and "
        "processing. The namespace of a node shows which of the two it is."
    ),
    bad="""\
system: rates
nodes:
  motor_controller:
    namespace: control
    timers: {step: {rate_hz: 5, log: step}}
""",
    good="""\
system: rates
nodes:
  motor_controller:
    namespace: control
    timers: {step: {rate_hz: 100, log: step}}
""",
)

#: Lowest and highest usual rate in hertz, by a level of the namespace.
BANDS_HZ = {"control": (50.0, 500.0), "perception": (10.0, 30.0)}
#: Tolerance factor, because periods may be rounded.
_TOLERANCE = 1.001


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the fastest timer of each node; slower timers do housekeeping."""
    for node in context.system.nodes:
        levels = set(node.namespace.value.split("/"))
        for word, band in BANDS_HZ.items():
            fastest = _fastest(node) if word in levels else None
            if fastest is not None:
                yield from _diagnostic(*fastest, word, band)


def _fastest(node: Node) -> tuple[Timer, float] | None:
    """Return the fastest timer with its rate in hertz."""
    known = ((timer, node.period_s(timer)) for timer in node.timers)
    rates = [(timer, 1.0 / period_s) for timer, period_s in known if period_s is not None]
    return max(rates, key=lambda found: found[1], default=None)


def _diagnostic(
    timer: Timer, rate_hz: float, word: str, band: tuple[float, float]
) -> Iterator[Diagnostic]:
    low_hz, high_hz = band
    if low_hz / _TOLERANCE <= rate_hz <= high_hz * _TOLERANCE:
        return
    yield Diagnostic(
        RULE,
        f"timer '{timer.name}' of a {word} node runs at {number(rate_hz)} Hz; "
        f"{number(low_hz)} to {number(high_hz)} Hz is usual",
        timer.period.span,
    )
