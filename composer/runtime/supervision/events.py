"""Events that a host reports while it runs, and the outcome of the run.

``str(event)`` is the line to show; for a stuck callback, the lines.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Concatenate, ParamSpec, TypeAlias

from composer.base.fast_dataclass import dataclass
from composer.model import LogLevel
from composer.runtime.clock import Clock
from composer.runtime.protocol.reports import CallbackFigures, ChainFigures

Event: TypeAlias = (
    "Logged | StateChanged | NodeTransitionFailed | RollingBack | RolledBack | BroughtUp"
    " | NodeFailed | Restarted | Commanded | CallbackFailed | Stopping | Stuck"
)
Report: TypeAlias = Callable[[Event], None]
P = ParamSpec("P")
#: The counters of a :class:`NodeSummary`.
COUNTERS = ("received", "sent", "calls", "dropped", "skipped", "errors")


@dataclass(frozen=True, slots=True)
class StateChanged:
    """A node has reached a primary state; ``elapsed_s`` counts from the start."""

    elapsed_s: float
    node: str
    transition: str
    state: str

    def __str__(self) -> str:
        return f"{self.node} {self.state}"


@dataclass(frozen=True, slots=True)
class NodeTransitionFailed:
    """A transition of a plan has failed."""

    elapsed_s: float
    node: str
    transition: str
    state: str
    reason: str

    def __str__(self) -> str:
        return f"{self.node}: {self.transition} failed, state {self.state}: {self.reason}"


@dataclass(frozen=True, slots=True)
class RollingBack:
    """The bring-up has failed; the nodes that it started are stopped in reverse order."""

    elapsed_s: float
    node: str
    reason: str

    def __str__(self) -> str:
        return f"rolling back because of {self.node}: {self.reason}"


@dataclass(frozen=True, slots=True)
class RolledBack:
    """The nodes that a failed bring-up had started are in their previous states again."""

    elapsed_s: float
    nodes: tuple[str, ...]

    def __str__(self) -> str:
        return f"rolled back: {', '.join(self.nodes) or 'nothing to undo'}"


@dataclass(frozen=True, slots=True)
class NodeFailed:
    """Nodes have failed for one reason; ``consequence`` is the reaction to that.

    ``is_tolerated``: the system does not need them, or ignores it. ``is_finished``: their programs
    have ended with exit status 0.
    """

    elapsed_s: float
    nodes: tuple[str, ...]
    reason: str
    consequence: str
    is_tolerated: bool = False
    is_finished: bool = False

    def __str__(self) -> str:
        verb = "ended" if self.is_finished else "failed"
        return f"{', '.join(self.nodes)} {verb}: {self.reason}; {self.consequence}"


@dataclass(frozen=True, slots=True)
class Restarted:
    """A node that had failed is where it should be again."""

    elapsed_s: float
    node: str
    attempt: int
    state: str = "active"

    def __str__(self) -> str:
        state = "up" if self.state == "active" else self.state
        return f"{self.node} is {state} again after restart {self.attempt}"


@dataclass(frozen=True, slots=True)
class Commanded:
    """A command was requested: for the whole system, or for ``nodes``."""

    elapsed_s: float
    command: str
    nodes: tuple[str, ...] = ()

    def __str__(self) -> str:
        of = f" of {', '.join(self.nodes)}" if self.nodes else ""
        return f"{self.command}{of} requested"


@dataclass(frozen=True, slots=True)
class BroughtUp:
    """The bring-up is over; ``remarks`` are about nodes that are not up, with the reasons.

    ``is_complete``: all nodes that the system needs are. ``missing`` are the remarks without the
    reasons: the log has them already.
    """

    elapsed_s: float
    active: int
    nodes: int
    remarks: tuple[str, ...] = ()
    is_complete: bool = True
    missing: tuple[str, ...] = ()

    def __str__(self) -> str:
        return self._with(self.missing)

    @property
    def with_reasons(self) -> str:
        """The line for those who do not see the log."""
        return self._with(self.remarks)

    def _with(self, remarks: tuple[str, ...]) -> str:
        active = f"{self.active} of {self.nodes} nodes active after {self.elapsed_s:.2f} s"
        return ", ".join((active, *remarks))


@dataclass(frozen=True, slots=True)
class CallbackFailed:
    """User code raised an exception or returned a wrong value; the log has the details."""

    elapsed_s: float
    node: str
    callback: str
    text: str

    def __str__(self) -> str:
        return f"{self.node} {self.callback}: {self.text}"


@dataclass(frozen=True, slots=True)
class Stopping:
    """The tear-down starts."""

    elapsed_s: float
    reason: str

    def __str__(self) -> str:
        return f"shutting down: {self.reason}"


@dataclass(frozen=True, slots=True)
class Stuck:
    """A node did not do something in time: ``deactivate``, ``return from on_tick within 1 s``.

    ``stack`` is where its executor hangs; empty if unknown.
    """

    elapsed_s: float
    node: str
    action: str
    stack: str

    def __str__(self) -> str:
        where = f" in\n{self.stack.rstrip()}" if self.stack else ""
        return f"{self.node} is stuck and did not {self.action}{where}"


@dataclass(frozen=True, slots=True)
class Logged:
    """A line of the log. ``logger`` is the full name of the node with dots, as in ROS."""

    elapsed_s: float
    logger: str
    level: LogLevel
    message: str

    def __str__(self) -> str:
        return f"[{self.elapsed_s:.3f}] [{self.level.upper()}] [{self.logger}] {self.message}"


class Reporter:
    """Passes events to a listener, one at a time, from any thread.

    The system keeps running without its listener: the first exception of it ends the reports.
    """

    def __init__(
        self, listener: Report | None, clock: Clock, started_at_s: float | None = None
    ) -> None:
        """Count times of events from ``started_at_s``, by the clock; or from now."""
        self._clock = clock
        self._listener = listener
        # Reentrant: garbage collection may run a finalizer that logs, at any allocation.
        self._lock = threading.RLock()
        self._started_at_s = self._clock.monotonic() if started_at_s is None else started_at_s

    @property
    def elapsed_s(self) -> float:
        """The seconds since the start, for events."""
        return self._clock.monotonic() - self._started_at_s

    def report(
        self,
        kind: Callable[Concatenate[float, P], Event],
        *details: P.args,
        **more_details: P.kwargs,
    ) -> None:
        """Pass an event of this kind to the listener: it happens now."""
        with self._lock:
            if self._listener is None:
                return
            event = kind(self.elapsed_s, *details, **more_details)
            try:
                self._listener(event)
            except Exception:  # such as a closed pipe
                self._listener = None

    def log(self, level: LogLevel, logger: str, message: str) -> None:
        """Report a line of the log."""
        self.report(Logged, logger, level, message)


@dataclass(frozen=True, slots=True)
class NodeSummary:
    """The final state and the counters of one node.

    ``received`` and ``sent`` count topic messages; ``calls`` requests and goals in both directions;
    ``dropped`` messages that arrived or were sent while the node was not active, or were dropped
    from a full queue; ``skipped`` timer calls skipped because the previous one was still running;
    ``errors`` exceptions and wrong results of user code, and failed calls. If it is not
    ``is_counted``, as an executable, they are not known, and 0.
    """

    node: str
    state: str
    received: int
    sent: int
    calls: int
    dropped: int
    skipped: int
    errors: int
    is_counted: bool = True


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a run ended. ``exit_code`` is 0 after a clean stop and 1 if a node failed.

    ``remarks`` are about nodes that were not up at the end. ``hung`` is true if the process must
    end by ``os._exit``: a callback never returned, or nodes were not destroyed one by one.
    """

    exit_code: int
    reason: str
    elapsed_s: float
    nodes: tuple[NodeSummary, ...]
    hung: bool = False
    callbacks: tuple[CallbackFigures, ...] = ()
    chains: tuple[ChainFigures, ...] = ()
    remarks: tuple[str, ...] = ()
