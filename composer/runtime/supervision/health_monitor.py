"""Watches nodes that raise nothing: silent ones, ones that hang, ones with too many errors."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import FrameType

from composer.model import PrimaryState
from composer.plan import Fault, FaultKind
from composer.runtime.node.node import RunningNode
from composer.runtime.supervision.interruption import RunningCallback, running_callbacks
from composer.runtime.supervision.node_set import NodeSet

_SHORTEST_PERIOD_S = 0.005
_LONGEST_PERIOD_S = 1.0
_LOOKS_PER_LIMIT = 5
#: Handlers of transitions have a limit of their own, which ends those that await.
_TRANSITION_MARGIN_S = 2.0
#: How long an interrupted callback may take to end before its loop is given up.
_ENDS_WITHIN_S = 1.0
#: A loop whose callbacks all began so short a time ago does not hang.
_GOES_ON_AFTER_S = 0.5
_ERRORS_SEEN_WITHIN_MS = 250.0


@dataclass(frozen=True, slots=True)
class Hanging:
    """A callback takes too long. ``node`` is a key; ``stack`` is where it is."""

    node: str
    callback: str
    limit_s: float
    stack: str


@dataclass(frozen=True, slots=True)
class LoopRecovered:
    """A callback whose loop was given up has ended after all. ``loop`` is its name."""

    loop: str


News = Fault | Hanging | LoopRecovered


@dataclass(slots=True)
class _Seen:
    """A callback that was there when somebody looked. ``since_s`` is when that was first so."""

    callback: RunningCallback
    loop: str
    since_s: float
    node: str | None = None  # its key; of what was there once only, nobody asks whose it is
    limit_s: float = math.inf
    interrupted_s: float | None = None
    given_up: bool = False


class HealthMonitor:
    """A thread that looks at the nodes of a node_set again and again, and tells what it finds."""

    def __init__(self, node_set: NodeSet, tell: Callable[[News], None]) -> None:
        self._node_set = node_set
        self._tell = tell
        self._end = threading.Event()
        self._callbacks: dict[FrameType, _Seen] = {}  # by their calls
        watches = {name: _NodeWatch(name, node_set) for name in node_set.nodes}
        self._nodes = {name: watch for name, watch in watches.items() if watch.has_limits}
        self._period_s = _period_s(node_set)
        self._system_is_up = False
        self._thread = threading.Thread(target=self._run, name="composer watch", daemon=True)

    def start(self) -> None:
        """Begin to look."""
        self._thread.start()

    def system_is_up(self) -> None:
        """Expect from now on what nodes do that are active: before, some wait for others."""
        self._system_is_up = True

    def stop(self) -> None:
        """Look no more."""
        self._end.set()
        if self._thread.is_alive():
            self._thread.join()

    def _run(self) -> None:
        while not self._end.wait(self._period_s):
            now_s = time.monotonic()
            self._look_at_callbacks(now_s)
            self._look_at_hung_loops(now_s)
            if self._system_is_up:
                self._look_at_nodes(now_s)

    def _look_at_nodes(self, now_s: float) -> None:
        """Look at what nodes do; those of a loop that is blocked can do nothing."""
        blocked = {seen.loop for seen in self._interrupted()} | self._node_set.hung
        for name, watch in self._nodes.items():
            if self._node_set.nodes[name].loop.name not in blocked:
                for fault in watch.look(now_s):
                    self._tell(fault)

    # --- callbacks

    def _look_at_callbacks(self, now_s: float) -> None:
        before, self._callbacks = self._callbacks, {}
        for loop in tuple(self._node_set.loops.values()):
            for found in running_callbacks(loop):
                for callback in found:
                    seen = before.pop(callback.call, None) or _Seen(callback, loop.name, now_s)
                    seen.callback = callback  # the same call, but by now it may be somewhere else
                    self._callbacks[callback.call] = seen
                self._judge_thread([self._callbacks[callback.call] for callback in found], now_s)
        for seen in before.values():
            self._take_end(seen)

    def _judge_thread(self, seen: list[_Seen], now_s: float) -> None:
        """Judge the innermost callback; those that it keeps waiting do not hang themselves."""
        innermost, *outer = seen
        if innermost.since_s == now_s:
            return
        if innermost.node is None:
            self._identify(innermost)
        if innermost.node is not None:
            self._judge(innermost, innermost.node, now_s)
        if innermost.interrupted_s is not None:
            for waiting in outer:
                waiting.since_s = now_s

    def _identify(self, seen: _Seen) -> None:
        """Find whose it is, unless that was made anew just now."""
        nodes = dict(self._node_set.nodes)
        owner = seen.callback.node(nodes.values())
        for name, node in nodes.items():
            if node is owner:
                seen.node, seen.limit_s = name, self._limit_s(seen.callback, name, node)

    def _limit_s(self, callback: RunningCallback, name: str, node: RunningNode) -> float:
        """Return how long a callback may take; handlers of transitions have a limit of theirs."""
        if callback.in_transition:
            return self._node_set.timeout_s(name) + _TRANSITION_MARGIN_S
        limit = node.model.supervision.watch.callback_ms
        return math.inf if limit is None else limit.value / 1000.0

    def _judge(self, seen: _Seen, node: str, now_s: float) -> None:
        if now_s - seen.since_s < seen.limit_s:
            return
        if seen.interrupted_s is None:
            seen.interrupted_s = now_s
            callback = seen.callback
            self._tell(Hanging(node, callback.name, seen.limit_s, callback.stack()))
            # Or the next callback hangs as soon as this one ends.
            self._node_set.nodes[node].stand_still()
            callback.interrupt()
        elif not seen.given_up and now_s - seen.interrupted_s > _ENDS_WITHIN_S:
            seen.given_up = True
            what = f"{seen.callback.name} does not return"
            self._tell(Fault(node, FaultKind.LOST, what, now_s))

    def _interrupted(self) -> list[_Seen]:
        return [seen for seen in self._callbacks.values() if seen.interrupted_s is not None]

    def _take_end(self, seen: _Seen) -> None:
        """Tell of the end of a callback that was interrupted."""
        if seen.node is None or seen.interrupted_s is None:
            return
        if not (seen.given_up or seen.callback.in_transition):
            what = f"{seen.callback.name} took longer than {1000.0 * seen.limit_s:g} ms"
            self._tell(Fault(seen.node, FaultKind.CALLBACK, what, time.monotonic()))

    def _look_at_hung_loops(self, now_s: float) -> None:
        """Tell of loops that were given up and go on; again and again, until somebody hears."""
        for loop in tuple(self._node_set.hung):
            ages_s = [
                now_s - seen.since_s for seen in self._callbacks.values() if seen.loop == loop
            ]
            if max(ages_s, default=0.0) < _GOES_ON_AFTER_S:
                self._tell(LoopRecovered(loop))


class _NodeWatch:
    """What one node has done while it was active."""

    def __init__(self, name: str, node_set: NodeSet) -> None:
        self._name = name
        self._node_set = node_set
        supervision = node_set.nodes[name].model.supervision
        watch = supervision.watch
        self._silences: list[_Silence] = []
        if watch.silence_ms is not None:
            self._silences.append(_Silence(None, watch.silence_ms.value / 1000.0))
        for topic, limit in watch.topics:
            self._silences.append(_Silence(topic.value, limit.value / 1000.0))
        self._max_errors = math.inf if watch.max_errors is None else watch.max_errors.value
        self._window_s = supervision.restart.window_ms / 1000.0
        self._errors: deque[tuple[float, int]] = deque()  # when there were how many in all
        self._has_failed = False
        self._life: tuple[RunningNode, int] | None = None

    @property
    def has_limits(self) -> bool:
        """Whether there is anything to look for."""
        return bool(self._silences) or self._max_errors != math.inf

    def look(self, now_s: float) -> Iterator[Fault]:
        """Yield a fault when the node has failed; one at most until it is active anew."""
        node = self._node_set.nodes[self._name]
        if self._life != (node, node.activations):
            self._life = (node, node.activations)
            self._begin_anew()
        if self._has_failed or node.state != PrimaryState.ACTIVE.value:
            return
        found = [silence.look(node, now_s) for silence in self._silences]
        text = next(filter(None, found), None)
        kind = FaultKind.SILENCE
        if text is None:
            kind, text = FaultKind.ERRORS, self._look_at_errors(node.statistics.errors, now_s)
        if text is not None:
            self._has_failed = True
            yield Fault(self._name, kind, text, now_s)

    def _begin_anew(self) -> None:
        self._has_failed = False
        self._errors.clear()
        for silence in self._silences:
            silence.begin_anew()

    def _look_at_errors(self, errors: int, now_s: float) -> str | None:
        if not self._errors or self._errors[-1][1] != errors:
            self._errors.append((now_s, errors))
        while len(self._errors) > 1 and self._errors[1][0] < now_s - self._window_s:
            self._errors.popleft()
        if errors - self._errors[0][1] <= self._max_errors:
            return None
        return f"more than {self._max_errors:g} errors within {self._window_s:g} s"


@dataclass(slots=True)
class _Silence:
    """How long one publisher, or all of a node's (None), have been silent.

    What counts from look to look is the shorter of what went by of real time and of the node's own:
    a simulation that is slow, paused or jumps makes no fault. A look that comes late counts as two
    at the most: what has held it up may have held up the node, too.
    """

    publisher: str | None
    limit_s: float
    sent: int = -1  # when it was last looked at; -1: not since the node is active
    silent_s: float = 0.0
    looked_s: float = 0.0
    looked_own_s: float = 0.0  # by the node's time

    def begin_anew(self) -> None:
        """Forget what was seen."""
        self.sent = -1

    def look(self, node: RunningNode, now_s: float) -> str | None:
        """Return how long there was nothing, if that is too long."""
        sent = node.statistics.sent if self.publisher is None else node.sent(self.publisher)
        own_now_s = node.now_s()
        if sent != self.sent:
            self.sent, self.silent_s = sent, 0.0
        else:
            passed_s = min(now_s - self.looked_s, own_now_s - self.looked_own_s)
            most_s = 2.0 * self.limit_s / _LOOKS_PER_LIMIT
            self.silent_s += min(max(passed_s, 0.0), most_s)
        self.looked_s, self.looked_own_s = now_s, own_now_s
        if self.silent_s <= self.limit_s:
            return None
        what = "silent" if self.publisher is None else f"silent on '{self.publisher}'"
        return f"{what} for {1000.0 * self.limit_s:g} ms"


def _period_s(node_set: NodeSet) -> float:
    """Return how often to look, so that each limit is kept with a fifth of it to spare."""
    limits_ms: list[float] = []
    for node in node_set.nodes.values():
        watch = node.model.supervision.watch
        found = [watch.silence_ms, watch.callback_ms, *(limit for _, limit in watch.topics)]
        limits_ms += [limit.value for limit in found if limit is not None]
        if watch.max_errors is not None:
            limits_ms.append(_ERRORS_SEEN_WITHIN_MS)
    shortest_s = min(limits_ms, default=math.inf) / 1000.0 / _LOOKS_PER_LIMIT
    return min(max(shortest_s, _SHORTEST_PERIOD_S), _LONGEST_PERIOD_S)
