"""A rate that is unusual for what a node says it is."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.words import number
from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.model import Node, Timer

RULE = register(
    Rule(
        code="RC412",
        name="rate-band",
        severity=Severity.INFO,
        summary="A control or perception node runs at a rate that is unusual for it.",
        why=(
            "Control loops usually run at 50 to 500 Hz: slower ones are unstable, faster ones need "
            "a real-time system. Perception runs at 10 to 30 Hz, as fast as sensors and "
            "processing allow. What a node is, its namespace says."
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
)

#: Lowest and highest usual rate in hertz, by a level of the namespace.
BANDS_HZ = {"control": (50.0, 500.0), "perception": (10.0, 30.0)}
#: Rates are compared with this much room, for periods that are rounded.
_ROOM = 1.001


def check(context: Context) -> Iterator[Diagnostic]:
    """Look at the fastest timer of each node: slower ones are for housekeeping."""
    for node in context.system.nodes:
        levels = set(node.namespace.value.split("/"))
        for word, band in BANDS_HZ.items():
            fastest = _fastest(node) if word in levels else None
            if fastest is not None:
                yield from _finding(*fastest, word, band)


def _fastest(node: Node) -> tuple[Timer, float] | None:
    """Return the fastest timer with its rate in hertz."""
    known = ((timer, node.period_s(timer)) for timer in node.timers)
    rates = [(timer, 1.0 / period_s) for timer, period_s in known if period_s is not None]
    return max(rates, key=lambda found: found[1], default=None)


def _finding(
    timer: Timer, rate_hz: float, word: str, band: tuple[float, float]
) -> Iterator[Diagnostic]:
    low_hz, high_hz = band
    if low_hz / _ROOM <= rate_hz <= high_hz * _ROOM:
        return
    yield Diagnostic(
        RULE,
        f"timer '{timer.name}' of a {word} node runs at {number(rate_hz)} Hz; "
        f"usual are {number(low_hz)} to {number(high_hz)} Hz",
        timer.period.span,
    )
