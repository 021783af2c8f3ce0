"""How a system is run: limits of time, and what its process is."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Protocol, TypeVar

from composer.base.fast_dataclass import dataclass
from composer.model import LogLevel, Node, Port, Process
from composer.model.qos import QosProfile
from composer.runtime.clock import COMPUTER, Clock

R = TypeVar("R")
#: Joining the ROS graph takes a tenth of a second, on a busy machine some tenths.
_SHORTEST_START_LIMIT_S = 5.0
#: A phase that has a time limit and takes that much longer hangs: C code may hold the GIL forever,
#: and then nothing in Python can end it. The last plan of a phase may be slow.
_HANGS_AFTER_S = 60.0


class Target(Protocol):
    """Receives messages in this process."""

    def put(self, message: Any, /) -> None:
        """Receive the message, from any thread. It must not wait."""


class Recorder(Protocol):
    """Receives what the nodes in the process send: messages, calls, transitions, the log."""

    def tap(self, topic: str, type_name: str, profile: QosProfile) -> Target | None:
        """Return what receives the messages of a topic; None if it is not recorded."""

    def save(self, done: Callable[[bool, str], None]) -> None:
        """Write the last seconds; ``done`` receives whether that succeeded, and where or why."""


class Instruments(Protocol):
    """What a test sees and changes of the nodes in the process."""

    def receiver(self, port: Port, receiver: R) -> R:
        """Return what receives the messages of a subscription in its place."""

    def behavior(self, node: Node, behavior: object) -> None:
        """Prepare a new behavior, before its handlers are bound."""

    def callback(self, node: str, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return what a node (its full name) calls in the place of a callback of its class."""

    def timer(self, node: str, timer: str, tick: Callable[[], None]) -> Callable[[], None]:
        """Return what a timer of a node (its full name) calls in the place of ``tick``."""


@dataclass(frozen=True, slots=True)
class HostOptions:
    """How a system is run.

    ``run_for_s`` is how long it runs, ``bring_up_within_s`` the limit of the whole bring-up,
    ``stop_within_s`` that of the tear-down. With ``all_or_nothing``, a node that fails during
    bring-up ends the run, whatever its policy. ``transition_timeout_s`` overrides the system's.
    ``tracing`` records callback timings, also of callbacks without a ``budget_ms``;
    ``check_mutation`` checks after each callback whether it has modified a message.
    ``fail_on_error`` makes errors of user code and failed calls a failure of the run.

    ``process`` is set if the system is the part of another one that a process of it runs;
    ``report_key`` is then that of its reports if the coordinating process has started it.
    ``member_command`` starts such processes of this system, with ``--process NAME`` after it;
    without it, they are only awaited.

    ``end_within(seconds)`` has to end the process after that time, whatever hangs in it; None
    cancels that. It is called with ``grace_s`` as soon as the system stops, and never canceled
    then: the end of Python may hang as well. It also limits each call of the start that may never
    return from the middleware and, with a minute to spare, the bring-up and a run of ``run_for_s``.
    ``ends_process`` promises that the process ends after the run, by ``os._exit`` if the outcome
    requires it. ``on_alive()`` is called every second. Times of events count from ``started_at_s``,
    by ``clock``; by default, from when the host is created. ``clock`` is the clock of the system.
    With ``seed``, which is 0 by default in virtual time, random numbers are the same in each run.
    ``instruments`` belong to a test. ``recorder`` receives what nodes send.
    """

    run_for_s: float | None = None
    log_level: LogLevel = LogLevel.INFO
    bring_up_within_s: float = math.inf
    all_or_nothing: bool = False
    transition_timeout_s: float | None = None
    stop_within_s: float = 1.7
    grace_s: float = 10.0
    end_within: Callable[[float | None], None] = lambda _: None
    tracing: bool = True
    check_mutation: bool = False
    fail_on_error: bool = False
    ends_process: bool = False
    on_alive: Callable[[], None] = lambda: None
    started_at_s: float | None = None
    clock: Clock = COMPUTER
    seed: int | None = None
    process: Process | None = None
    report_key: str = ""
    member_command: Sequence[str] = ()
    instruments: Instruments | None = None
    recorder: Recorder | None = None


class TimeLimits:
    """Ends the process if what runs does not return, by ``end_within`` of the options."""

    def __init__(self, options: HostOptions) -> None:
        self._options = options
        self._is_end_limited = False  # the time to the end of the process

    def limit_start(self) -> None:
        """Limit the next call that joins the ROS graph: signals are not handled during it."""
        self._limit(max(self._options.grace_s, _SHORTEST_START_LIMIT_S))

    def limit_phase(self, phase_s: float) -> None:
        """Limit a phase that may take this long, which may be infinite, with a minute to spare."""
        self._limit(phase_s + _HANGS_AFTER_S if math.isfinite(phase_s) else None)

    def limit_end(self) -> None:
        """Limit the time from now to the end of the process, once."""
        if not self._is_end_limited:
            self._is_end_limited = True
            self._options.end_within(self._options.grace_s)

    def _limit(self, limit_s: float | None) -> None:
        """End the process after this time, unless the time to its end is limited already."""
        if not self._is_end_limited:
            self._options.end_within(limit_s)
            if self._is_end_limited:  # meanwhile, by a signal or another thread
                self._options.end_within(self._options.grace_s)
