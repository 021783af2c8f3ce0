"""How long data takes on the chains of a system file: from one publisher to another, far behind.

Each node on the way remembers since when what it heard last is on its way; the next message it
publishes to the chain carries that on, once: of two made from the same data the first counts, and
a node that publishes without having heard anything new carries nothing on. A message is known
again by its identity. Where it is copied, or goes by DDS, the order tells, which is right while no
message is lost and nobody else publishes to the topic.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from itertools import pairwise
from time import monotonic
from typing import Any

from composer.model import Node, Port, System
from composer.runtime.metrics.statistics import ChainStatistics

_ON_THE_WAY = 256  # messages from one node to the next; of more, the oldest are forgotten


class Hop:
    """One publisher of a chain."""

    def __init__(self, chain: ChainStatistics, following: Hop | None, *, is_first: bool) -> None:
        self._chain = chain
        self._following = following
        self._is_first = is_first
        self._since_s: float | None = None
        self._coming: deque[tuple[int, float | None]] = deque(maxlen=_ON_THE_WAY)
        self._knows_again = False

    def put(self, message: Any) -> None:
        """Take a message that is being published."""
        now_s = monotonic()
        since_s, self._since_s = now_s if self._is_first else self._since_s, None
        if self._following is not None:
            self._following._coming.append((id(message), since_s))
        elif since_s is not None:
            self._chain.take(now_s - since_s)

    def hear(self, message: Any) -> None:
        """Take a message that comes from the publisher before, or from any other of its topic."""
        coming = self._coming
        identity = id(message)
        if any(known == identity for known, _ in tuple(coming)):
            self._knows_again = True
            while (first := coming.popleft())[0] != identity:
                pass
        elif coming and not self._knows_again:
            first = coming.popleft()
        else:
            return
        if first[1] is not None:
            self._since_s = first[1]


@dataclass(frozen=True, slots=True)
class NodeChains:
    """The hops of one node: by its publisher, and by the topic that it hears."""

    node: str
    hops: tuple[tuple[str, str, Hop], ...] = ()

    def watching(self, port: Port) -> tuple[Hop, ...]:
        """Return those that are to get what a publisher sends."""
        return tuple(hop for name, _, hop in self.hops if name == port.name.value)

    def hearing(self, port: Port) -> tuple[Hop, ...]:
        """Return those that are to hear what a subscription gets."""
        return tuple(hop for _, topic, hop in self.hops if topic == port.full_name)


class Chains:
    """All chains of a system."""

    def __init__(self, system: System, *, tracing: bool) -> None:
        """With ``tracing`` false none is watched."""
        self.statistics: list[ChainStatistics] = []
        self._hops: dict[str, list[tuple[str, str, Hop]]] = {}
        for chain in system.chains if tracing else ():
            counted = ChainStatistics(chain.name.value, chain.latency_ms.value)
            self.statistics.append(counted)
            heard = {after: system.port(before) for before, after in pairwise(chain.through)}
            following: Hop | None = None
            for end in reversed(chain.through):
                following = Hop(counted, following, is_first=end not in heard)
                port = heard.get(end)
                topic = "" if port is None else port.full_name
                self._hops.setdefault(end.node, []).append((end.port, topic, following))

    def of(self, node: Node) -> NodeChains:
        """Return what a node has to do with them."""
        name = node.name.value
        return NodeChains(name, tuple(self._hops.get(name, ())))
