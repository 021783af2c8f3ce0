"""One process that runs one system: bring-up, up-keep, tear-down.

How a command uses it::

    from composer.runtime.environment import StartRefused
    from composer.runtime.host import Host, HostOptions

    host = Host(system, bring_up(system), tear_down(system), HostOptions(run_for_s=5.0), report)
    try:
        outcome = host.run()          # on the main thread: it owns SIGINT, SIGTERM and SIGHUP
    except StartRefused as refusal:   # nothing was started; str(refusal), refusal.hint
        ...
    outcome.exit_code, outcome.reason, outcome.nodes   # see composer.runtime.events
    if outcome.hung: os._exit(outcome.exit_code)       # after flushing

``report`` is called with every :mod:`composer.runtime.events` event, from several threads, one
call at a time; ``str(event)`` is the line to show.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import rclpy
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown

from composer.behavior import CallCancelled
from composer.model import Executor, ExecutorKind, LogLevel, Node, System
from composer.plan import Plan, Step
from composer.runtime.environment import StartRefused, prepare_environment
from composer.runtime.events import (
    BroughtUp,
    Event,
    Fault,
    Logged,
    NodeSummary,
    Outcome,
    Report,
    RollingBack,
    StateChanged,
    Stopping,
    Stuck,
    TransitionRefused,
)
from composer.runtime.executors import log_exception, make_loop
from composer.runtime.lifecycle import Result
from composer.runtime.log import describe
from composer.runtime.loop import Loop
from composer.runtime.node import Listener, NodeOptions, RunningNode
from composer.runtime.parameters import ParameterError
from composer.runtime.signals import stop_signals
from composer.runtime.stop_request import StopRequest
from composer.source import Located

#: Where a transition ends when all goes well.
_GOALS = {
    "configure": "inactive",
    "activate": "active",
    "deactivate": "inactive",
    "cleanup": "unconfigured",
    "shutdown": "finalized",
}
#: The most that one step of the tear-down may take of the time for all of it.
_STEP_SHARE = 0.6
_HURRY_S = 0.2
#: A transition ends itself in time; only a callback that does not return outlasts it by this.
_STUCK_AFTER_S = 1.0


@dataclass(frozen=True, slots=True)
class HostOptions:
    """How a system is run.

    ``run_for_s`` ends it by itself; ``stop_within_s`` is the time for the whole tear-down. If the
    process still stands ``grace_s`` after the request to stop, ``hard_exit`` is called, on a
    thread of its own: it is to end the process.
    """

    run_for_s: float | None = None
    log_level: LogLevel = LogLevel.INFO
    transition_timeout_s: float = 10.0
    stop_within_s: float = 2.0
    grace_s: float = 10.0
    hard_exit: Callable[[], None] | None = None


class Host:
    """Runs one system, once."""

    def __init__(
        self,
        system: System,
        up: Plan,
        down: Plan,
        options: HostOptions | None = None,
        report: Report | None = None,
    ) -> None:
        self._system = system
        self._up = up
        self._down = down
        self._plan_down: tuple[Step, ...] = ()  # nothing to do before the loops run
        self._options = options or HostOptions()
        self._listener = report
        self._report_lock = threading.Lock()
        self._started_at_s = time.monotonic()
        self._loops: dict[str, Loop] = {}
        self._nodes: dict[str, RunningNode] = {}
        self._stop = StopRequest()
        self._failed = False
        self._summary: tuple[NodeSummary, ...] = ()
        self._end_s = math.inf  # when the tear-down has to be through
        self._remains = False  # something that only the end of the process removes
        self._hung: set[str] = set()  # the loops with a callback that does not return

    def stop(self, reason: str) -> None:
        """Ask for the end, from any thread or a signal handler. Asking again hurries."""
        self._stop.ask(reason)

    def run(self) -> Outcome:
        """Bring the system up, keep it up until it is to stop, tear it down.

        Raises StartRefused when the environment does not allow a start.
        """
        prepare_environment()
        self._started_at_s = time.monotonic()
        with stop_signals(self.stop):
            _start_ros()
            try:
                if self._create() and self._bring_up():
                    self._stop.wait(self._options.run_for_s)
                with self._hard_exit():
                    self._tear_down()
                    self._close()
            except BaseException:
                self._close()
                raise
        return self._outcome()

    # --- up

    def _create(self) -> bool:
        executors = {executor.name.value: executor for executor in self._system.executors}
        for node in self._system.nodes:
            executor = _executor_of(node, executors)
            try:
                self._nodes[node.name.value] = self._create_node(node, executor)
            except ParameterError as error:
                self._roll_back(node.full_name, str(error))
                return False
            except Exception as error:
                self._roll_back(node.full_name, f"it cannot be created: {describe(error)}")
                return False
        for loop in self._loops.values():
            loop.start()
        self._plan_down = self._down.steps
        return True

    def _create_node(self, node: Node, executor: Executor) -> RunningNode:
        if executor.name.value not in self._loops:
            self._loops[executor.name.value] = make_loop(executor, _take_exception)
        name = node.full_name
        return RunningNode(
            node,
            self._loops[executor.name.value],
            NodeOptions(
                parallel=executor.kind is ExecutorKind.MULTI_THREADED,
                log_level=self._options.log_level,
                transition_timeout_s=self._options.transition_timeout_s,
            ),
            Listener(
                on_rest=lambda transition, state: self._take_rest(name, transition, state),
                on_fault=lambda callback, text: self._take_fault(name, callback, text),
                write_log=self._write_log,
            ),
        )

    def _bring_up(self) -> bool:
        limit_s = self._options.transition_timeout_s + _STUCK_AFTER_S
        for step in self._up.steps:
            if self._stop.reason is not None:
                return False
            result = self._make(step, limit_s, stoppable=True)
            if self._stop.reason is not None:
                return False
            if result is None or not result.success:
                node = self._nodes[step.node]
                reason = "it is stuck" if result is None else result.reason
                self._roll_back(node.full_name, f"it did not {step.transition}: {reason}")
                return False
        active = sum(node.state == "active" for node in self._nodes.values())
        self._report(BroughtUp(self._elapsed_s(), active, len(self._nodes)))
        return True

    def _roll_back(self, node: str, reason: str) -> None:
        self._failed = True
        self._report(RollingBack(self._elapsed_s(), node, reason))
        self._stop.ask(f"{node} failed")

    # --- down

    def _tear_down(self) -> None:
        if self._stop.reason is None:
            self._stop.ask(f"{self._options.run_for_s:g} s are over")
        self._report(Stopping(self._elapsed_s(), self._reason))
        self._end_s = time.monotonic() + self._options.stop_within_s
        for step in self._plan_down:
            node = self._nodes[step.node]
            if node.loop.name in self._hung or step.transition not in node.legal:
                continue
            left_s = self._end_s - time.monotonic()
            if left_s <= 0.0:
                break
            self._make(
                step, min(_STEP_SHARE * self._options.stop_within_s, left_s), stoppable=False
            )
        self._summary = tuple(_summary(node) for node in self._nodes.values())

    @contextmanager
    def _hard_exit(self) -> Iterator[None]:
        """End the process if the block does not end within the grace period."""
        watchdog = threading.Timer(self._options.grace_s, self._options.hard_exit or (lambda: None))
        watchdog.daemon = True
        watchdog.start()
        try:
            yield
        finally:
            watchdog.cancel()

    def _close(self) -> None:
        for name, loop in self._loops.items():
            if not loop.stop(_HURRY_S):
                self._hung.add(name)
        end_s = self._end_s
        if self._stop.hurry:
            end_s = min(end_s, time.monotonic() + _HURRY_S)
        # Fast DDS takes longer for each endpoint the more there are: seconds for 100 nodes. What
        # there is no time for is missed by others when its lease ends.
        for node in reversed(self._nodes.values()):
            if node.loop.name in self._hung or time.monotonic() > end_s:
                self._remains = True
            else:
                node.destroy()
        try_shutdown()

    def _outcome(self) -> Outcome:
        return Outcome(
            exit_code=1 if self._failed or self._hung else 0,
            reason=self._reason,
            elapsed_s=self._elapsed_s(),
            nodes=self._summary,
            hung=self._remains,
        )

    @property
    def _reason(self) -> str:
        return self._stop.reason or ""

    # --- both ways

    def _make(self, step: Step, limit_s: float, *, stoppable: bool) -> Result | None:
        """Make one step; None when it did not end in time or was given up."""
        node = self._nodes[step.node]
        future = node.loop.run_task(node.change(step.transition))
        if not self._stop.wait_for(future, limit_s, stoppable=stoppable):
            if not (stoppable and self._stop.reason is not None):
                self._take_stuck(node, step.transition)
            return None
        if future.cancelled():
            return None  # the executor stops
        result = future.result()
        if not result.success:
            self._failed = True
            self._report(
                TransitionRefused(
                    self._elapsed_s(),
                    node.full_name,
                    step.transition,
                    result.state,
                    result.reason,
                )
            )
        return result

    def _take_stuck(self, node: RunningNode, transition: str) -> None:
        self._failed = True
        stack = node.loop.where()
        if stack:
            self._hung.add(node.loop.name)
        self._report(Stuck(self._elapsed_s(), node.full_name, transition, stack))

    def _take_rest(self, node: str, transition: str, state: str) -> None:
        if state != _GOALS[transition] and state in ("unconfigured", "finalized"):
            self._failed = True  # it went through error processing
        self._report(StateChanged(self._elapsed_s(), node, transition, state))

    def _take_fault(self, node: str, callback: str, text: str) -> None:
        self._report(Fault(self._elapsed_s(), node, callback, text))

    def _write_log(self, level: LogLevel, logger: str, message: str) -> None:
        self._report(Logged(self._elapsed_s(), logger, level, message))

    def _report(self, event: Event) -> None:
        with self._report_lock:
            if self._listener is None:
                return
            try:
                self._listener(event)
            except Exception:  # nobody reads any more; the system is more than its spectators
                self._listener = None

    def _elapsed_s(self) -> float:
        return time.monotonic() - self._started_at_s


def _start_ros() -> None:
    try:
        rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    except rclpy_implementation.RCLError as error:
        raise StartRefused(f"ROS does not start: {error}", "see the lines above") from error


def _executor_of(node: Node, executors: dict[str, Executor]) -> Executor:
    """Return the executor the node runs on; without one it is ``default``, an event loop."""
    if node.executor is not None:
        return executors[node.executor.value]
    return executors.get("default") or Executor(
        Located("default", node.span), ExecutorKind.EVENTS, node.span
    )


def _take_exception(what: str, error: BaseException) -> None:
    """Log what leaves a callback; that a call ended with its node is nothing to tell."""
    if not isinstance(error, CallCancelled):
        log_exception(what, error)


def _summary(node: RunningNode) -> NodeSummary:
    counted = node.statistics
    return NodeSummary(
        node=node.full_name,
        state=node.state,
        received=counted.received,
        sent=counted.sent,
        calls=counted.calls,
        dropped=counted.dropped,
        skipped=counted.skipped,
        errors=counted.errors,
    )
