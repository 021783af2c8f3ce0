"""Monitors nodes for failures that raise no exception: silence, and callbacks that hang."""

from __future__ import annotations

import math
import threading
from types import FrameType

from composer.base.fast_dataclass import dataclass
from composer.model import LogLevel, PrimaryState
from composer.plan import Fault, FaultKind
from composer.runtime.callbacks.log import logger_name
from composer.runtime.node.interruption import RunningCallback, running_callbacks
from composer.runtime.node.managed_node import ManagedNode
from composer.runtime.supervision.events import Stuck
from composer.runtime.supervision.main_queue import LoopRecovered, SupervisionContext
from composer.runtime.supervision.node_set import NodeSet

_SHORTEST_PERIOD_S = 0.005
_LONGEST_PERIOD_S = 1.0
_CHECKS_PER_LIMIT = 5
#: Handlers of transitions have a limit of their own, which ends asynchronous ones.
_TRANSITION_MARGIN_S = 2.0
#: A callback without a limit is reported once it has run for so long.
BLOCKS_AFTER_S = 5.0
#: How long an interrupted callback may take to return before its loop is abandoned.
_RETURNS_WITHIN_S = 1.0
#: A hung loop has recovered once all its callbacks are younger than this.
_RECOVERED_WITHIN_S = 0.5
#: A node and how often it had become active.
_Activation = tuple[ManagedNode, int]


@dataclass(slots=True)
class _ObservedCallback:
    """A running callback. ``since_s`` is the time of the check that observed it first."""

    callback: RunningCallback
    loop: str
    since_s: float
    node: str | None = None  # its key, once the callback was observed twice
    limit_s: float = math.inf
    interrupted_s: float | None = None
    is_lost: bool = False


class CheckTime:
    """The time of periodic checks. A late check counts at most as two periods.

    What delayed the check may have delayed the callbacks too.
    """

    def __init__(self, period_s: float, now_s: float) -> None:
        self._period_s = period_s
        self._checked_s = now_s
        self._late_s = 0.0  # the delays of all checks together

    def advance(self, now_s: float) -> float:
        """Return the time of a check at ``now_s``."""
        self._late_s += max(now_s - self._checked_s - 2.0 * self._period_s, 0.0)
        self._checked_s = now_s
        return now_s - self._late_s


class HealthMonitor:
    """A thread that checks the nodes of a node set periodically and reports failures."""

    def __init__(self, context: SupervisionContext) -> None:
        self._context = context
        self._clock = context.clock
        self._serial = 0  # of the desired state before the check
        self._end = threading.Event()
        self._callbacks: dict[FrameType, _ObservedCallback] = {}  # by their calls
        self._reported: set[tuple[str, str]] = set()  # nodes and their callbacks that block
        # What nodes of other processes send is not known here; those of the system check it there.
        own = [name for name, node in context.node_set.nodes.items() if node.model.in_process]
        self._silences = [
            item for name in own for item in _silences(name, context.node_set.nodes[name])
        ]
        self._silent: dict[str, _Activation] = {}  # nodes that were reported in their activation
        self._period_s = _period_s(context.node_set)
        self._time = CheckTime(self._period_s, self._clock.monotonic())
        self._thread = threading.Thread(target=self._run, name="health monitor", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._clock.start(self._thread)

    def stop(self) -> None:
        """Stop the thread."""
        self._end.set()
        if self._thread.is_alive():
            self._clock.join(self._thread)

    def _run(self) -> None:
        while not self._clock.wait(self._end, self._period_s):
            now_s = self._clock.monotonic()
            self._serial = self._context.desired.value.serial
            check_s = self._time.advance(now_s)
            self._check_callbacks(check_s)
            self._check_hung_loops(check_s)
            if self._context.node_set.run_state.is_up:
                self._check_silences(now_s)

    def _check_silences(self, now_s: float) -> None:
        """Check the publishers of nodes, except on blocked loops, which cannot publish."""
        interrupted = [item for item in self._callbacks.values() if item.interrupted_s is not None]
        blocked = {item.loop for item in interrupted} | self._context.node_set.hung
        for silence in self._silences:
            node = self._context.node_set.nodes[silence.node]
            if node.state != PrimaryState.ACTIVE or node.loop.name in blocked:
                continue
            activation = (node, node.activations)
            text = silence.check(activation, now_s)
            if text is not None and self._silent.get(silence.node) != activation:
                self._silent[silence.node] = activation
                self._context.main_queue.put(
                    Fault(silence.node, FaultKind.SILENCE, text, self._serial)
                )

    # --- callbacks

    def _check_callbacks(self, now_s: float) -> None:
        before, self._callbacks = self._callbacks, {}
        for loop in tuple(self._context.node_set.loops.values()):
            for stack in running_callbacks(loop.busy_threads()):
                for callback in stack:
                    observed = before.pop(callback.call, None)
                    observed = observed or _ObservedCallback(callback, loop.name, now_s)
                    observed.callback = callback  # the same call, but maybe at another line
                    self._callbacks[callback.call] = observed
                self._check_thread([self._callbacks[callback.call] for callback in stack], now_s)
        for observed in before.values():
            self._on_return(observed)

    def _check_thread(self, stack: list[_ObservedCallback], now_s: float) -> None:
        """Check the innermost callback; the callbacks that wait for it do not hang themselves."""
        innermost, *outer = stack
        if innermost.since_s == now_s:
            return
        if innermost.node is None:
            self._identify(innermost)
        if innermost.node is not None:
            self._check_limit(innermost, innermost.node, now_s)
        if innermost.interrupted_s is not None:
            for waiting in outer:
                waiting.since_s = now_s

    def _identify(self, observed: _ObservedCallback) -> None:
        """Set the node of a callback and its limit, unless the node was just created again."""
        nodes = dict(self._context.node_set.nodes)
        owner = observed.callback.node(nodes.values())
        for name, node in nodes.items():
            if node is owner:
                observed.node = name
                observed.limit_s = _limit_s(observed.callback, node)

    def _check_limit(self, observed: _ObservedCallback, node: str, now_s: float) -> None:
        callback = observed.callback
        lasts_s = now_s - observed.since_s
        if lasts_s < observed.limit_s:
            if lasts_s >= BLOCKS_AFTER_S and (node, callback.name) not in self._reported:
                self._reported.add((node, callback.name))
                # Once: it may be meant to, or it may hang.
                text = f"{callback.name} has not returned for {lasts_s:.0f} s; it is at"
                logger = logger_name(self._context.full_name(node))
                self._context.reporter.log(LogLevel.WARN, logger, f"{text} {callback.location()}")
            return
        if observed.interrupted_s is None:
            observed.interrupted_s = now_s
            action = f"return from {callback.name} within {1000.0 * observed.limit_s:g} ms"
            self._context.reporter.report(
                Stuck, self._context.full_name(node), action, callback.stack()
            )
            # Otherwise the next callback hangs as soon as this one returns.
            self._context.node_set.nodes[node].block()
            callback.interrupt()
        elif not observed.is_lost and now_s - observed.interrupted_s > _RETURNS_WITHIN_S:
            observed.is_lost = True
            text = f"{callback.name} does not return"
            self._context.main_queue.put(Fault(node, FaultKind.LOST, text, self._serial))

    def _on_return(self, observed: _ObservedCallback) -> None:
        """Report the end of a callback that was interrupted."""
        if observed.node is None or observed.interrupted_s is None:
            return
        if not (observed.is_lost or observed.callback.in_transition):
            text = f"{observed.callback.name} took longer than {1000.0 * observed.limit_s:g} ms"
            self._context.main_queue.put(
                Fault(observed.node, FaultKind.CALLBACK, text, self._serial)
            )

    def _check_hung_loops(self, now_s: float) -> None:
        """Report hung loops that run again, at each check until the supervisor has handled it."""
        for loop in tuple(self._context.node_set.hung):
            ages_s = [
                now_s - item.since_s for item in self._callbacks.values() if item.loop == loop
            ]
            if max(ages_s, default=0.0) < _RECOVERED_WITHIN_S:
                self._context.main_queue.put(LoopRecovered(loop))


def _limit_s(callback: RunningCallback, node: ManagedNode) -> float:
    """Return the time limit of a callback; handlers of transitions have one of their own."""
    if callback.in_transition:
        return node.transition_timeout_s + _TRANSITION_MARGIN_S
    limit = node.model.supervision.watch.callback_ms
    return math.inf if limit is None else limit.value / 1000.0


@dataclass(slots=True)
class _Silence:
    """How long one publisher, or all publishers of a node (None), have been silent.

    Between two checks, the shorter of real time and the node's time counts, so that a simulation
    that is slow, paused or jumps is not a fault. A late check counts at most as two: what delayed
    it may have delayed the node as well.
    """

    node: str
    publisher: str | None
    limit_s: float
    activation: _Activation | None = None  # at the last check
    sent: int = 0  # at the last check
    silent_s: float = 0.0
    checked_s: float = 0.0
    checked_node_s: float = 0.0  # by the node's time

    def check(self, activation: _Activation, now_s: float) -> str | None:
        """Return a text if the silence since the activation exceeds the limit."""
        node, _ = activation
        sent = node.statistics.sent if self.publisher is None else node.sent(self.publisher)
        node_now_s = node.now_s()
        if (activation, sent) != (self.activation, self.sent):
            self.activation, self.sent, self.silent_s = activation, sent, 0.0
        else:
            passed_s = min(now_s - self.checked_s, node_now_s - self.checked_node_s)
            maximum_s = 2.0 * self.limit_s / _CHECKS_PER_LIMIT
            self.silent_s += min(max(passed_s, 0.0), maximum_s)
        self.checked_s, self.checked_node_s = now_s, node_now_s
        if self.silent_s <= self.limit_s:
            return None
        subject = "silent" if self.publisher is None else f"silent on '{self.publisher}'"
        return f"{subject} for {1000.0 * self.limit_s:g} ms"


def _silences(name: str, node: ManagedNode) -> list[_Silence]:
    """Return what is to be checked of a node."""
    watch = node.model.supervision.watch
    found = [_Silence(name, topic.value, limit.value / 1000.0) for topic, limit in watch.topics]
    if watch.silence_ms is not None:
        found.insert(0, _Silence(name, None, watch.silence_ms.value / 1000.0))
    return found


def _period_s(node_set: NodeSet) -> float:
    """Return the period of the checks: a fifth of the shortest limit."""
    limits_ms: list[float] = []
    for node in node_set.nodes.values():
        watch = node.model.supervision.watch
        limits = [watch.silence_ms, watch.callback_ms, *(limit for _, limit in watch.topics)]
        limits_ms += [limit.value for limit in limits if limit is not None]
    shortest_s = min(limits_ms, default=math.inf) / 1000.0 / _CHECKS_PER_LIMIT
    return min(max(shortest_s, _SHORTEST_PERIOD_S), _LONGEST_PERIOD_S)
