"""Chains of publishers, and the delays along them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import pairwise

from composer.base.diagnostics import Diagnostic, Label, Subject, error, warning
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.model import Chain, Node, Port, PortKind, System, Timer
from composer.rules.analysis.context import Context
from composer.rules.analysis.formatting import number
from composer.rules.analysis.rates import causes
from composer.rules.analysis.subjects import NODES_OF_PROCESSES, wiring

IMPOSSIBLE_CHAIN = error("RC415", "impossible-chain")
UNMEASURED_CHAIN = warning("RC477", "unmeasured-chain")


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
