"""What happens on the way of a chain."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

from composer.analysis.context import Context
from composer.analysis.publications import causes
from composer.model import Chain, Node, Port, PortKind, Timer
from composer.source import Span


@dataclass(frozen=True, slots=True)
class Delay:
    """What may hold data up on its way, how long in milliseconds, and where that is said."""

    what: str
    milliseconds: float
    span: Span


def inputs(node: Node, topic: str) -> Iterator[Port]:
    """Yield the subscriptions of a node to a topic."""
    for port in node.ports_of(PortKind.SUBSCRIPTION):
        if port.full_name == topic:
            yield port


def delays(context: Context, chain: Chain) -> Iterator[Delay]:
    """Yield what may hold data up behind the first publisher of a chain.

    A node that passes on what it hears does so within its callback's budget. One that publishes by
    a timer lets data wait for up to the timer's period.
    """
    for before, after in pairwise(chain.through):
        port, node = context.system.port(before), context.system.node(after.node)
        if port is None or node is None:
            continue
        of_port = context.once(causes).get((after.node, after.port), ())
        heard = {item.name.value for item in inputs(node, port.full_name)}
        passing = [item.port for item in of_port if item.port and item.port.name.value in heard]
        timers = [item.timer for item in of_port if item.timer is not None]
        if passing:
            yield from _budget(f"{node.name}.{passing[0].name}", passing[0])
        elif timers and len(timers) == len(of_port):
            yield from _wait(node, timers)


def _wait(node: Node, timers: list[Timer]) -> Iterator[Delay]:
    """Yield the wait for whichever timer comes first."""
    known = [(node.period_s(timer), timer) for timer in timers]
    periods = [(period_s, timer) for period_s, timer in known if period_s is not None]
    if not periods:
        return
    period_s, timer = min(periods, key=lambda found: found[0])
    name = f"{node.name}.{timer.name}"
    yield Delay(f"{name} comes every", period_s * 1000.0, timer.period.span)
    yield from _budget(name, timer)


def _budget(name: str, callback: Port | Timer) -> Iterator[Delay]:
    budget_ms = callback.budget_ms
    if budget_ms is not None:
        yield Delay(f"{name} may take", budget_ms.value, budget_ms.span)
