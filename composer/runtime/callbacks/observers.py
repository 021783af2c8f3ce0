"""What is observed of messages: the latencies of chains, and changes by callbacks.

A chain measures how long data takes from the first publisher to the last. Each node on the chain
keeps the start time of the data that it received last, and its next message on the chain carries it
on, once: of two messages computed from the same data the first counts, and a message that is
published without new data carries nothing. A received message is recognized by its identity. If it
is copied or comes by DDS, by its order, which is right as long as no message is lost and the topic
has no other publisher.

``compose run --check-mutation`` finds callbacks that change published or received messages. Ports
of one process share messages by reference, so a change affects all of them. The check compares the
serialized form of a node's latest messages after each of its callbacks. That is slow: it is for
debugging, not for production.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Coroutine
from itertools import pairwise
from typing import Any, TypeVar
from weakref import WeakValueDictionary

from rclpy.serialization import serialize_message

from composer.base.fast_dataclass import dataclass
from composer.model import Node, Port, System
from composer.runtime.clock import Clock
from composer.runtime.executors.futures import Future
from composer.runtime.executors.strand import Work, in_steps
from composer.runtime.metrics.statistics import ChainStatistics

_MAX_IN_TRANSIT = 256  # messages from one node to the next; beyond, the oldest are forgotten
_REMEMBERED = 32  # messages per node
T = TypeVar("T")
#: Called with (the callback, what it did).
Report = Callable[[str, str], None]


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

    hops: tuple[tuple[str, str, Hop], ...]

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
        return NodeChains(tuple(self._hops.get(node.name.value, ())))


class _Snapshot:
    """A message and its serialized form at the last check."""

    __slots__ = ("__weakref__", "form", "message")

    def __init__(self, message: Any) -> None:
        self.message = message
        self.form = serialize_message(message)


class MessageSnapshots:
    """One snapshot of each message that a node of the process remembers."""

    def __init__(self) -> None:
        self._by_identity: WeakValueDictionary[int, _Snapshot] = WeakValueDictionary()

    def of(self, message: Any) -> _Snapshot:
        """Return the snapshot of the message, a new one if there is none."""
        snapshot = self._by_identity.get(id(message))
        if snapshot is None:
            snapshot = self._by_identity[id(message)] = _Snapshot(message)
        return snapshot


class MutationCheck:
    """The latest messages of one node, and whether they have changed."""

    def __init__(self, snapshots: MessageSnapshots, report: Report) -> None:
        self._snapshots = snapshots
        self._report = report
        self._latest: deque[tuple[_Snapshot, str]] = deque(maxlen=_REMEMBERED)

    def remember(self, message: Any, origin: str) -> None:
        """Check the message from now on; ``origin`` is reported: ``published by 'odometry'``."""
        self._latest.append((self._snapshots.of(message), origin))

    def wrap(self, callback: str, work: Work[T]) -> Work[T]:
        """Return ``work``, followed by a check."""

        def checked(item: T) -> Coroutine[Any, Any, None] | None:
            try:
                rest = work(item)
            finally:
                self.check(callback)
            return None if rest is None else self.wrap_steps(callback, rest)

        return checked

    def wrap_steps(
        self, callback: str, coroutine: Coroutine[Any, Any, T]
    ) -> Coroutine[Any, Any, T]:
        """Return ``coroutine`` with a check after each of its steps."""
        return in_steps(_CheckAfter(self, callback), coroutine)

    def check(self, callback: str) -> None:
        """Report messages that have changed since the last check: ``callback`` changed them."""
        for snapshot, origin in tuple(self._latest):
            form = serialize_message(snapshot.message)
            if form != snapshot.form:
                snapshot.form = form
                kind = type(snapshot.message).__name__
                self._report(callback, f"modified a message ({kind}) after it was {origin}")


class RememberingTarget:
    """Remembers each message that is put."""

    __slots__ = ("_check", "_origin")

    def __init__(self, check: MutationCheck, origin: str) -> None:
        self._check = check
        self._origin = origin

    def put(self, message: Any) -> None:
        """Check the message from now on."""
        self._check.remember(message, self._origin)


class _CheckAfter:
    """Checks after each step of a coroutine."""

    __slots__ = ("_callback", "_check")

    def __init__(self, check: MutationCheck, callback: str) -> None:
        self._check = check
        self._callback = callback

    def enter(self) -> Future[None] | None:
        """Begin a step, at once."""
        return None

    def leave(self) -> None:
        """Check."""
        self._check.check(self._callback)
