"""The delays along a chain."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from composer.analysis.context import Context
from composer.analysis.timing.publications import causes
from composer.fast_dataclass import dataclass
from composer.model import Chain, Node, Port, PortKind, Timer
from composer.source import Span


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
