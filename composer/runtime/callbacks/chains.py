"""How long data takes on the chains of a system file, from the first publisher to the last.

Each node on the chain keeps the start time of the data that it received last, and its next message
on the chain carries it on, once: of two messages computed from the same data the first counts, and
a message that is published without new data carries nothing. A received message is recognized by
its identity. If it is copied or comes by DDS, by its order, which is right as long as no message is
lost and the topic has no other publisher.
"""

from __future__ import annotations

from collections import deque
from itertools import pairwise
from typing import Any

from composer.base.fast_dataclass import dataclass
from composer.model import Node, Port, System
from composer.runtime.clock import Clock
from composer.runtime.metrics.statistics import ChainStatistics

_MAX_IN_TRANSIT = 256  # messages from one node to the next; beyond, the oldest are forgotten


class Hop:
    """One publisher of a chain."""

    def __init__(
        self, chain: ChainStatistics, following: Hop | None, clock: Clock, *, is_first: bool
    ) -> None:
        self._monotonic = clock.monotonic
        self._chain = chain
        self._following = following
        self._is_first = is_first
        self._start_s: float | None = None
        self._in_transit: deque[tuple[int, float | None]] = deque(maxlen=_MAX_IN_TRANSIT)
        self._by_identity = False

    def put(self, message: Any) -> None:
        """Note a message that is being published."""
        now_s = self._monotonic()
        start_s, self._start_s = now_s if self._is_first else self._start_s, None
        if self._following is not None:
            self._following._in_transit.append((id(message), start_s))
        elif start_s is not None:
            self._chain.add(now_s - start_s)

    def on_received(self, message: Any) -> None:
        """Note a message from the previous publisher, or from another one of its topic."""
        in_transit = self._in_transit
        identity = id(message)
        if any(known == identity for known, _ in tuple(in_transit)):
            self._by_identity = True
            while (first := in_transit.popleft())[0] != identity:
                pass
        elif in_transit and not self._by_identity:
            first = in_transit.popleft()
        else:
            return
        if first[1] is not None:
            self._start_s = first[1]


@dataclass(frozen=True, slots=True)
class NodeChains:
    """The hops of one node: by its publisher, and by the topic that it receives."""

    node: str
    hops: tuple[tuple[str, str, Hop], ...] = ()

    def published_by(self, port: Port) -> tuple[Hop, ...]:
        """Return the hops that note what a publisher sends."""
        return tuple(hop for name, _, hop in self.hops if name == port.name.value)

    def received_by(self, port: Port) -> tuple[Hop, ...]:
        """Return the hops that note what a subscription receives."""
        return tuple(hop for _, topic, hop in self.hops if topic == port.full_name)


class Chains:
    """All chains of a system."""

    def __init__(self, system: System, clock: Clock, *, tracing: bool) -> None:
        """Without ``tracing``, no chain is observed."""
        self.statistics: list[ChainStatistics] = []
        self._hops: dict[str, list[tuple[str, str, Hop]]] = {}
        for chain in system.chains if tracing else ():
            statistics = ChainStatistics(chain.name.value, chain.latency_ms.value)
            self.statistics.append(statistics)
            inputs = {after: system.port(before) for before, after in pairwise(chain.through)}
            following: Hop | None = None
            for end in reversed(chain.through):
                following = Hop(statistics, following, clock, is_first=end not in inputs)
                port = inputs.get(end)
                topic = "" if port is None else port.full_name
                self._hops.setdefault(end.node, []).append((end.port, topic, following))

    def of(self, node: Node) -> NodeChains:
        """Return the hops of a node."""
        name = node.name.value
        return NodeChains(name, tuple(self._hops.get(name, ())))
