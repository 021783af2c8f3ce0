"""What the host tells while it runs. Whoever starts it decides what of it is shown, and how.

Every event prints as one line (a stuck callback as several).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from composer.model import LogLevel
from composer.runtime.metrics.figures import CallbackFigures, ChainFigures


@dataclass(frozen=True, slots=True)
class StateChanged:
    """A node has come to rest in a primary state; ``elapsed_s`` counts from the start."""

    elapsed_s: float
    node: str
    transition: str
    state: str

    def __str__(self) -> str:
        return f"{self.node} {self.state}"


@dataclass(frozen=True, slots=True)
class NodeTransitionFailed:
    """A transition of the plan did not get where it was to."""

    elapsed_s: float
    node: str
    transition: str
    state: str
    reason: str

    def __str__(self) -> str:
        return f"{self.node} did not {self.transition}, it is {self.state}: {self.reason}"


@dataclass(frozen=True, slots=True)
class RollingBack:
    """The bring-up failed; what it had started is stopped in reverse order."""

    elapsed_s: float
    node: str
    reason: str

    def __str__(self) -> str:
        return f"rolling back because of {self.node}: {self.reason}"


@dataclass(frozen=True, slots=True)
class RolledBack:
    """What a bring-up that failed had started is where it was before, in the order of that."""

    elapsed_s: float
    nodes: tuple[str, ...]

    def __str__(self) -> str:
        return f"rolled back: {', '.join(self.nodes) or 'nothing, there was nothing to undo'}"


@dataclass(frozen=True, slots=True)
class NodeFailed:
    """A node of a system that is up has failed; ``consequence`` is what is done about it."""

    elapsed_s: float
    node: str
    reason: str
    consequence: str

    def __str__(self) -> str:
        return f"{self.node} failed: {self.reason}; {self.consequence}"


@dataclass(frozen=True, slots=True)
class Restarted:
    """A node that had failed is up again, and so are those that depend on it."""

    elapsed_s: float
    node: str
    attempt: int

    def __str__(self) -> str:
        return f"{self.node} is up again, restart {self.attempt}"


@dataclass(frozen=True, slots=True)
class Commanded:
    """Somebody outside wants something of the whole system."""

    elapsed_s: float
    what: str

    def __str__(self) -> str:
        return f"{self.what}, asked for from outside"


@dataclass(frozen=True, slots=True)
class BroughtUp:
    """Every step of the bring-up is done."""

    elapsed_s: float
    active: int
    nodes: int

    def __str__(self) -> str:
        return f"{self.active} of {self.nodes} nodes active after {self.elapsed_s:.2f} s"


@dataclass(frozen=True, slots=True)
class CallbackFailed:
    """User code raised or returned what it must not; the full story is in the log."""

    elapsed_s: float
    node: str
    callback: str
    text: str

    def __str__(self) -> str:
        return f"{self.node} {self.callback}: {self.text}"


@dataclass(frozen=True, slots=True)
class Stopping:
    """The tear-down begins."""

    elapsed_s: float
    reason: str

    def __str__(self) -> str:
        return f"stopping: {self.reason}"


@dataclass(frozen=True, slots=True)
class Stuck:
    """A node did not answer in time. ``stack`` is where its executor hangs; empty if unknown."""

    elapsed_s: float
    node: str
    transition: str
    stack: str

    def __str__(self) -> str:
        where = f" in\n{self.stack.rstrip()}" if self.stack else ""
        return f"{self.node} is stuck and did not {self.transition}{where}"


@dataclass(frozen=True, slots=True)
class Logged:
    """A node has something to say. ``logger`` is its full name with dots, as ROS writes it."""

    elapsed_s: float
    logger: str
    level: LogLevel
    message: str

    def __str__(self) -> str:
        return f"[{self.elapsed_s:.3f}] [{self.level.upper()}] [{self.logger}] {self.message}"


Event: TypeAlias = (
    "Logged | StateChanged | NodeTransitionFailed | RollingBack | RolledBack | BroughtUp"
    " | NodeFailed | Restarted | Commanded | CallbackFailed | Stopping | Stuck"
)
Report: TypeAlias = Callable[[Event], None]


@dataclass(frozen=True, slots=True)
class NodeSummary:
    """What one node did.

    ``received`` and ``sent`` count topic messages; ``calls`` requests and goals, both ways;
    ``dropped`` messages that came or were to leave while the node was not active, or that a full
    queue pushed out; ``skipped`` calls of timers whose call before was not through; ``errors``
    exceptions and wrong results of user code, and failed calls.
    """

    node: str
    state: str
    received: int
    sent: int
    calls: int
    dropped: int
    skipped: int
    errors: int


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a run ended. ``exit_code`` is 0 after a clean stop and 1 when a node failed.

    ``hung`` is true when something remains that only the end of the process removes: a callback
    that never returned, or nodes that were not given back one by one. ``os._exit`` has to end it.
    """

    exit_code: int
    reason: str
    elapsed_s: float
    nodes: tuple[NodeSummary, ...]
    hung: bool = False
    callbacks: tuple[CallbackFigures, ...] = ()
    chains: tuple[ChainFigures, ...] = ()
