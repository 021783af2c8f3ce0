"""What the supervision knows of a node, whatever implements it and wherever it runs."""
# ruff: noqa: B027  nothing to do is the default of many methods

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

from composer.base.fast_dataclass import dataclass
from composer.model import LogLevel, Node
from composer.model.lifecycle import available_transitions
from composer.plan import FaultKind
from composer.runtime.executors.futures import Future
from composer.runtime.metrics.statistics import Statistics

if TYPE_CHECKING:  # tests of the supervision run without ROS
    from composer.runtime.executors.loop import Loop


@dataclass(frozen=True, slots=True)
class TransitionOutcome:
    """How a requested transition ended, in which state, and why it did not succeed.

    ``requested`` is false for the step of a plan; ``outdated`` is true for a step that was not run
    because a requested transition came first.
    """

    transition: str
    state: str
    success: bool
    reason: str = ""
    requested: bool = True
    outdated: bool = False


class NodeListener(Protocol):
    """Receives what a node reports, on the threads of the node's loop. It must not block."""

    def on_transition_end(self, result: TransitionOutcome) -> None:
        """Receive the end of a transition."""

    def on_error(self, callback: str, text: str) -> None:
        """Receive an error of user code, at most once a second for each callback."""

    def on_fault(self, kind: FaultKind, text: str) -> None:
        """Receive that the node has failed: it says so, or has exceeded its ``max_errors``."""

    def on_ended(self, text: str, *, is_awaited: bool = False) -> None:
        """Receive that a node outside the process has ended by itself, and is unconfigured now.

        With ``is_awaited``, it cannot be started from here, and its return will be reported.
        """

    def on_returned(self) -> None:
        """Receive that a node that had disappeared by itself is there again."""

    def write_log(self, level: LogLevel, logger: str, message: str) -> None:
        """Receive a line of the log."""


@dataclass(slots=True)
class RunState:
    """What all nodes of a system follow of its run. Any thread may read and set it.

    ``is_up`` is set after the bring-up: silence and errors count as faults from then on, as some
    nodes have waited for others before. ``end_s`` (monotonic) is set while the system shuts down:
    nothing may last longer. With ``leaves_others``, nodes that were not started here keep their
    states, because another system uses them. With ``keeps_entities``, ports are destroyed by the
    end of the process only.
    """

    is_up: bool = False
    end_s: float | None = None
    leaves_others: bool = False
    keeps_entities: bool = False


@dataclass(frozen=True, slots=True)
class ManagedContext:
    """What a node gets of its system, whatever implements it.

    It continues ``statistics``. ``timeout_s`` is the limit of each transition.
    """

    loop: Loop
    listener: NodeListener
    statistics: Statistics
    timeout_s: float
    run_state: RunState


class TransitionLock:
    """Lets one transition of a node run at a time. Thread-safe."""

    def __init__(self) -> None:
        self._changing = threading.Lock()
        self._current: Future[None] | None = None

    @property
    def is_held(self) -> bool:
        """Whether a transition runs."""
        return self._current is not None

    def try_acquire(self) -> Future[None] | None:
        """Acquire it, or return the future of the transition that runs."""
        with self._changing:
            if self._current is None:
                self._current = Future()
                return None
            return self._current

    async def acquire(self) -> None:
        """Acquire it as soon as no transition runs."""
        while (current := self.try_acquire()) is not None:
            await current

    def release(self) -> None:
        """Let the next transition run."""
        with self._changing:
            current, self._current = self._current, None
        if current is not None:
            current.set_result(None)


class ManagedLifecycle(ABC):
    """The transitions of a node. The coroutines run on the node's loop and raise nothing."""

    def __init__(self) -> None:
        self._lock = TransitionLock()
        self._after: Sequence[str] = ()  # of the step that runs

    @property
    @abstractmethod
    def state(self) -> str:
        """The label of the lifecycle state. Thread-safe."""

    @property
    def available(self) -> Mapping[str, int]:
        """The ids of the transitions that can be requested now, by name. Thread-safe."""
        return available_transitions(self.state)

    async def change(self, transition: str) -> TransitionOutcome:
        """Run a requested ``transition`` as soon as no other one runs."""
        await self._lock.acquire()
        return await self._run(transition, requested=True)

    async def run_step(
        self, transition: str, is_outdated: Callable[[], bool], after: Sequence[str] = ()
    ) -> TransitionOutcome:
        """Run the ``transition`` of a plan as soon as no other one runs.

        If ``is_outdated()`` then, do not run it: a requested transition came first. The process of
        a node lets the nodes ``after``, which are in it as well, move before; see MemberNode.
        """
        await self._lock.acquire()
        if not is_outdated():
            self._after = after
            return await self._run(transition, requested=False)
        self._lock.release()
        reason = "a requested transition came first"
        return TransitionOutcome(
            transition, self.state, success=False, reason=reason, requested=False, outdated=True
        )

    def fail_request(self) -> None:
        """Answer a pending request of an external node: its transition hangs. Thread-safe."""

    @abstractmethod
    async def _run(self, transition: str, *, requested: bool) -> TransitionOutcome:
        """Run a transition; the lock has been acquired, and is to be released at the end."""


class ManagedNode(ABC):
    """A node of a running system. Methods may be called from any thread unless they say else.

    What most nodes outside the process cannot do is nothing by default.
    """

    lifecycle: ManagedLifecycle

    def __init__(self, model: Node, context: ManagedContext) -> None:
        self.model = model
        self.loop = context.loop
        self.statistics = context.statistics
        self.activations = 0  # how often it became active
        #: When, by the clock of the loop, the work of its last transition started.
        self.transition_started_s = 0.0
        self._listener = context.listener
        self._timeout_s = context.timeout_s
        self._run_state = context.run_state

    @property
    def full_name(self) -> str:
        """The name ROS knows the node by."""
        return self.model.full_name

    @property
    def state(self) -> str:
        """The label of the lifecycle state."""
        return self.lifecycle.state

    @property
    def transition_timeout_s(self) -> float:
        """How long a transition may take before it counts as stuck."""
        return self._timeout_s

    @property
    def callback_owners(self) -> tuple[object, ...]:
        """The objects by which a running callback on a stack is recognized as the node's."""
        return ()

    @property
    def is_absent(self) -> bool:
        """Whether it is not there, and something else has to start it."""
        return False

    @property
    def has_finished(self) -> bool:
        """Whether it is a program that has ended itself, with exit status 0."""
        return False

    @property
    def figures(self) -> Mapping[str, Any]:
        """What is known of a node outside the process, by fields of ``NodeReport``."""
        return {}

    def now_s(self) -> float:
        """Return the node's time in seconds, outside the process the time of the system."""
        return self.loop.clock.time()

    def sent(self, publisher: str) -> int:
        """Return how many messages a publisher has sent, as far as this process knows."""
        return self.statistics.publisher(publisher).count

    def count(self, counter: str) -> int:
        """Return a counter of the node, by its name in a ``NodeSummary``."""
        return int(getattr(self.statistics, counter))

    def block(self) -> None:
        """Block all ports of a failed node until its next transition."""

    @abstractmethod
    def destroy(self) -> None:
        """Destroy the node in any state, on its loop, or after the loop has stopped."""
