"""What the main thread shares with others: the desired state, and the queue of what it handles.

The listeners of nodes put there what the nodes report, on the threads of the nodes.
"""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import field
from typing import TYPE_CHECKING, Generic, TypeAlias, TypeVar

from composer.base.fast_dataclass import dataclass
from composer.model import LogLevel, Node, PrimaryState, System
from composer.model.lifecycle import FINALIZED, TRANSITIONS
from composer.plan import DesiredState, Fault, FaultKind
from composer.plan.transitions import REACHED
from composer.runtime.clock import Clock
from composer.runtime.node.managed_node import TransitionOutcome
from composer.runtime.process.signals import wakeup_for
from composer.runtime.process.watchdog import SAME_REQUEST_S
from composer.runtime.supervision import events
from composer.runtime.supervision.events import Reporter
from composer.runtime.supervision.status import Status

if TYPE_CHECKING:  # tests of the supervision run without ROS
    from composer.runtime.supervision.node_set import NodeSet

#: What remains of any time limit after a second stop request.
_URGENT_S = 0.05
#: The states of a node that is down: an error in a handler also ends in one of these.
DOWN = (PrimaryState.UNCONFIGURED, FINALIZED)
T = TypeVar("T")
K = TypeVar("K")


class SharedDesiredState:
    """The current desired state. Thread-safe.

    Nodes record requested transitions, on their own threads, before they answer the request. The
    supervisor changes the rest, on the main thread. The lock gives all changes one order, and is
    held for microseconds only: no transition waits for the supervisor or for another node.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._value = DesiredState({})

    @property
    def value(self) -> DesiredState:
        """The desired state now."""
        return self._value

    def update(self, change: Callable[[DesiredState], DesiredState]) -> DesiredState:
        """Replace the desired state by ``change(desired state)``, and return that."""
        with self._lock:
            self._value = change(self._value)
            return self._value


@dataclass(frozen=True, slots=True)
class NodeMoved:
    """A node has moved, and no plan waits for it. ``node`` is a key, ``cause`` what moved it."""

    node: str
    cause: str


@dataclass(frozen=True, slots=True)
class StepEnded:
    """A step has ended that ran on after its plan. ``node`` is a key."""

    node: str


@dataclass(frozen=True, slots=True)
class LoopRecovered:
    """A callback whose loop was abandoned has returned after all. ``loop`` is its name."""

    loop: str


@dataclass(frozen=True, slots=True)
class NodeReturned:
    """An external node that had disappeared is there again. ``node`` is a key."""

    node: str


@dataclass(frozen=True, slots=True)
class Command:
    """A command for the system, see :mod:`.commands`. Call ``answer(success, message)`` once.

    ``nodes`` are the full names of the nodes that a restart is for. With ``all_or_nothing``, a
    bring-up is undone if a node fails that the system needs.
    """

    name: str
    answer: Callable[[bool, str], None]
    nodes: tuple[str, ...] = ()
    all_or_nothing: bool = False


NodeEvent: TypeAlias = Fault | NodeMoved | StepEnded | LoopRecovered | NodeReturned
Item: TypeAlias = NodeEvent | Command


class MainQueue(Generic[T]):
    """Items for the main thread, and the request to stop.

    It uses no locks: code that is interrupted by a signal handler might hold them.
    """

    def __init__(self, clock: Clock) -> None:
        #: The clock of the system.
        self.clock = clock
        #: Woken for every item and request; wake it to make :meth:`wait` check its condition.
        self.wakeup = wakeup_for(clock)
        self._items: deque[T] = deque()
        self._held = threading.local()
        #: Why the system stops; None while no stop is requested.
        self.stop_reason: str | None = None
        #: Whether a stop was requested a second time.
        self.urgent = False
        self._requested_s = 0.0

    @property
    def stopping(self) -> bool:
        """Whether a stop is requested."""
        return self.stop_reason is not None

    def request_stop(self, reason: str) -> None:
        """Request a stop, from any thread or a signal handler; a later second one is urgent."""
        now_s = self.clock.monotonic()
        if self.stop_reason is None:
            self.stop_reason = reason
            self._requested_s = now_s
        elif now_s - self._requested_s > SAME_REQUEST_S:
            self.urgent = True
        self.wakeup.wake()

    def put(self, item: T) -> None:
        """Append an item, from any thread."""
        held = getattr(self._held, "items", None)
        if held is not None:
            held.append(item)
            return
        self._items.append(item)
        self.wakeup.wake()

    def put_back(self, item: T) -> None:
        """Make an item that was just returned the next one again."""
        self._items.appendleft(item)

    @property
    def is_empty(self) -> bool:
        """Whether there are no items."""
        return not self._items

    @contextmanager
    def together(self) -> Iterator[None]:
        """Context manager: items that this thread puts become available at once, at its end."""
        held: list[T] = []
        self._held.items = held
        try:
            yield
        finally:
            self._held.items = None
            self._items.extend(held)
            self.wakeup.wake()

    def drain(self) -> list[T]:
        """Remove and return all items."""
        return [self._items.popleft() for _ in range(len(self._items))]

    def get(self, until_s: float = math.inf) -> T | None:
        """Return the next item; None when a stop is requested, or at ``until_s`` (monotonic)."""
        while not self.stopping and not self._items:
            if not self.wakeup.wait(until_s):
                break
        return self._items.popleft() if self._items and not self.stopping else None

    def take_next(self, kind: type[K]) -> list[K]:
        """Remove and return the first items, as far as they are of this kind."""
        taken: list[K] = []
        while self._items and isinstance(item := self._items[0], kind):
            self._items.popleft()
            taken.append(item)
        return taken

    def wait(self, condition: Callable[[], bool], until_s: float, *, stoppable: bool) -> bool:
        """Wait for ``condition()``, at most until ``until_s`` (monotonic); return its value.

        If ``stoppable``, a request to stop ends the wait; otherwise an urgent one shortens it.
        Items stay in the queue.
        """
        while not condition():
            if stoppable and self.stopping:
                break
            if self.urgent:
                until_s = min(until_s, self.clock.monotonic() + _URGENT_S)
            if not self.wakeup.wait(until_s):
                break
        return condition()


@dataclass(frozen=True, slots=True)
class SupervisionContext:
    """What all parts of the supervision of a system share."""

    system: System
    node_set: NodeSet
    main_queue: MainQueue[Item]
    status: Status
    reporter: Reporter
    #: Also changed by the nodes, which record requested transitions.
    desired: SharedDesiredState = field(default_factory=SharedDesiredState)

    @property
    def clock(self) -> Clock:
        """The clock of the system."""
        return self.main_queue.clock

    def full_name(self, name: str) -> str:
        """Return the full name of a node, by its key."""
        return self.node_set.nodes[name].full_name


class SupervisionListener:
    """Reports one node's transitions and errors to the status, the user and the supervisor.

    The state that a requested transition ends in becomes the desired one, before the node answers
    the request or starts another transition. The main queue receives it too, because other nodes
    may have to move. The plan executor waits for the result of a step.
    """

    def __init__(self, node: Node, context: SupervisionContext) -> None:
        self._name = node.name.value
        self._full_name = node.full_name
        self._context = context
        self._last_state = ""

    def on_transition_end(self, result: TransitionOutcome) -> None:
        """Report the new state; record a requested transition first."""
        item = self._record(result) if result.requested else None
        state = result.state
        self._context.status.set_state(self._name, state)
        if state != self._last_state:  # otherwise, the transition has failed
            self._last_state = state
            self._context.reporter.report(
                events.StateChanged, self._full_name, result.transition, state
            )
        if item is not None:
            self._context.main_queue.put(item)

    def _record(self, result: TransitionOutcome) -> Item:
        """Record a requested transition; return the item for the supervisor."""
        name = self._name
        if result.state == TRANSITIONS[result.transition].goal:
            goal = REACHED[result.transition]
            self._context.desired.update(lambda desired: desired.move(name, goal))
        elif result.state in DOWN:
            text = f"{result.transition} ended in an error: {result.reason}"
            serial = self._context.desired.update(lambda desired: desired.break_down(name)).serial
            return Fault(name, FaultKind.TRANSITION, text, serial)
        return NodeMoved(name, f"requested transition of {self._full_name}")

    def on_error(self, callback: str, text: str) -> None:
        """Report an error of user code."""
        self._context.status.set_error(self._name, f"{callback}: {text}")
        self._context.reporter.report(events.CallbackFailed, self._full_name, callback, text)

    def on_fault(self, kind: FaultKind, text: str) -> None:
        """Report that the node has failed: it says so, or has exceeded its ``max_errors``."""
        self._context.main_queue.put(
            Fault(self._name, kind, text, self._context.desired.value.serial)
        )

    def on_ended(self, text: str, *, is_awaited: bool = False) -> None:
        """Report that a node outside the process has ended by itself, and is unconfigured now.

        With ``is_awaited``, it cannot be started from here, and its return will be reported. No
        plan moves the node until the supervisor has handled the fault.
        """
        kind = FaultKind.ABSENT if is_awaited else FaultKind.ENDED
        fault = Fault(self._name, kind, text, self._context.desired.value.serial)
        self._context.desired.update(lambda desired: desired.await_fault(fault))
        self._last_state = state = PrimaryState.UNCONFIGURED.value
        self._context.status.set_state(self._name, state)
        self._context.reporter.report(events.StateChanged, self._full_name, "end", state)
        self._context.main_queue.put(fault)

    def on_returned(self) -> None:
        """Report that a node that had disappeared by itself is there again."""
        self._context.main_queue.put(NodeReturned(self._name))

    def write_log(self, level: LogLevel, logger: str, message: str) -> None:
        """Report a line of the log."""
        self._context.reporter.log(level, logger, message)
