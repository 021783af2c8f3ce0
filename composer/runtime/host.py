"""One process that runs one system: bring-up, up-keep, tear-down.

How a command uses it::

    from composer.runtime.host import Host, HostOptions
    from composer.runtime.process import StartRefused

    host = Host(system, bring_up(system), tear_down(system), HostOptions(run_for_s=5.0), report)
    try:
        outcome = host.run()          # on the main thread: it owns SIGINT, SIGTERM and SIGHUP
    except StartRefused as refusal:   # nothing was started; str(refusal), refusal.hint
        ...
    outcome.exit_code, outcome.reason, outcome.nodes   # see composer.runtime.supervision.events
    if outcome.hung: os._exit(outcome.exit_code)       # after flushing

``report`` is called with every ``events`` event, from several threads, one
call at a time; ``str(event)`` is the line to show.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable
from dataclasses import dataclass

import rclpy
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown

from composer.model import LogLevel, PrimaryState, System
from composer.model.dependencies import dependency_edges, in_dependency_order
from composer.plan import Fault, FaultKind, Plan
from composer.runtime.callbacks.log import describe
from composer.runtime.manager.node import Command, Manager, ManagerCallbacks, manager_namespace
from composer.runtime.node.node import Listener, RunningNode, Shared
from composer.runtime.process import StartRefused
from composer.runtime.process.dds_profiles import use_large_system_profile
from composer.runtime.process.environment import prepare_environment
from composer.runtime.process.fast_exit import leave_ros_graph, supports_fast_exit
from composer.runtime.process.instance_lock import already_running, hold_instance_lock
from composer.runtime.process.signals import stop_signals
from composer.runtime.supervision import events
from composer.runtime.supervision.commands import Commands
from composer.runtime.supervision.events import NodeSummary, Outcome, Report
from composer.runtime.supervision.health_monitor import Hanging, HealthMonitor, LoopRecovered
from composer.runtime.supervision.main_queue import MainQueue
from composer.runtime.supervision.node_set import FINALIZED, CreationFailed, NodeSet, NodeSetOptions
from composer.runtime.supervision.reporter import Reporter
from composer.runtime.supervision.status import Status
from composer.runtime.supervision.supervisor import ExternalTransition, Supervisor

#: Where a transition ends when all goes well.
_GOALS = {
    "configure": "inactive",
    "activate": "active",
    "deactivate": "inactive",
    "cleanup": "unconfigured",
    "shutdown": FINALIZED,
}
_DOWN = (PrimaryState.UNCONFIGURED.value, FINALIZED)
#: The most that one step of the tear-down may take of the time for all of it.
_STEP_SHARE = 0.6
_HURRY_S = 0.2
#: So many nodes are given back one by one within half a second.
_FEW_NODES = 20
#: Joining the ROS graph takes a tenth of a second, on a busy machine some tenths.
_SHORTEST_START_LIMIT_S = 5.0


@dataclass(frozen=True, slots=True)
class HostOptions:
    """How a system is run.

    ``tracing`` is whether the times of callbacks are taken, also of those without a ``budget_ms``;
    ``check_mutation`` whether messages are looked at after each callback, for who changes them.
    ``run_for_s`` ends it by itself; ``bring_up_within_s`` is the time for the whole bring-up;
    ``transition_timeout_s`` goes before what the system says; ``stop_within_s`` is the time for the
    whole tear-down. ``end_within(seconds)`` is to end the process after so long, whatever hangs in
    it, and None to call that off. Asked for are ``grace_s`` seconds as soon as the system is to
    stop, and that is never called off: the end of Python may hang, too. The same holds for each
    call of the start that a middleware may never return from. ``ends_process`` promises that the
    process ends once the run has, by ``os._exit`` where the outcome says so.
    """

    run_for_s: float | None = None
    log_level: LogLevel = LogLevel.INFO
    bring_up_within_s: float = math.inf
    transition_timeout_s: float | None = None
    stop_within_s: float = 1.7
    grace_s: float = 10.0
    end_within: Callable[[float | None], None] = lambda _: None
    tracing: bool = True
    check_mutation: bool = False
    ends_process: bool = False


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
        self._options = options or HostOptions()
        self._main_queue: MainQueue[object] = MainQueue()
        self._reporter = Reporter(report)
        order = in_dependency_order(system, dependency_edges(system))
        self._status = Status(system, order)
        self._node_set = NodeSet(
            system,
            self._listener,
            NodeSetOptions(
                log_level=self._options.log_level,
                transition_timeout_s=self._options.transition_timeout_s,
                tracing=self._options.tracing,
                check_mutation=self._options.check_mutation,
            ),
        )
        self._supervisor = Supervisor(
            system, self._node_set, self._main_queue, self._status, self._reporter
        )
        self._commands = Commands(system, self._node_set, self._supervisor, self._status)
        self._failed = False
        self._ends = False  # the time to the end of the process is limited
        self._is_created = False
        self._summary: tuple[NodeSummary, ...] = ()
        self._farewells: list[Command] = []
        self._end_s = math.inf  # when the tear-down has to be through
        self._remains = False  # something that only the end of the process removes
        self._leaves_at_once = self._options.ends_process and len(system.nodes) > _FEW_NODES
        self._has_left = False  # all of it is out of the ROS graph

    def stop(self, reason: str) -> None:
        """Ask for the end, from any thread or a signal handler. Asking again hurries."""
        self._limit_end()
        self._main_queue.ask(reason)

    def run(self) -> Outcome:
        """Bring the system up, keep it up until it is to stop, tear it down.

        Raises StartRefused when the environment does not allow a start, or the system runs already.
        """
        prepare_environment()
        if self._leaves_at_once:
            use_large_system_profile(os.environ)
        namespace = manager_namespace(self._system.namespace, self._system.name.value)
        signals = stop_signals(
            self.stop, self._main_queue.bell, ends_process=self._options.ends_process
        )
        with hold_instance_lock(namespace), signals:
            self._limit_start()
            _start_ros()
            try:
                self._run(namespace)
            finally:
                if not self._has_left:  # or there is nothing left to shut down
                    try_shutdown()
        return self._outcome()

    def _run(self, namespace: str) -> None:
        office = ManagerCallbacks(
            self._obey,
            self._measure,
            self._node_set.callbacks,
            self._node_set.chains,
            lambda host, pid: self._yield_to(namespace, host, pid),
            lambda: {node.full_name: node for node in tuple(self._node_set.nodes.values())},
        )
        manager = Manager(namespace, self._status, office, use_sim_time=self._system.use_sim_time)
        try:
            if self._create(manager.shared):
                self._live()
        finally:
            self._limit_end()
            self._tear_down()
            self._close(manager)

    # --- up

    def _limit_start(self) -> None:
        """Limit the next call that joins the ROS graph; signals have no effect before its end."""
        if not self._ends:
            self._options.end_within(max(self._options.grace_s, _SHORTEST_START_LIMIT_S))

    def _lift_limit(self) -> None:
        if not self._ends:
            self._options.end_within(None)

    def _create(self, shared: Shared) -> bool:
        try:
            self._node_set.create(shared, self._limit_start)
            self._lift_limit()
        except CreationFailed as error:
            at_s = self._reporter.elapsed_s
            self._reporter.tell(events.RollingBack(at_s, error.node, str(error)))
            self._fail(f"{error.node} failed")
            return False
        for refused in self._node_set.refusals:
            self._write_log(LogLevel.WARN, "composer", refused)
        self._is_created = True
        return True

    def _live(self) -> None:
        watch = HealthMonitor(self._node_set, self._main_queue.put)
        watch.start()
        try:
            if self._bring_up():
                watch.system_is_up()
                self._keep_up()
        finally:
            watch.stop()

    def _bring_up(self) -> bool:
        failed = self._supervisor.bring_up(self._up, self._options.bring_up_within_s)
        if failed is not None:
            self._fail(f"{failed.partition(':')[0]} failed")
        if self._main_queue.closing:
            return False
        self._supervisor.want(self._node_set.states())
        self._status.set_activity("running")
        self._reporter.tell(
            events.BroughtUp(
                self._reporter.elapsed_s, self._node_set.active(), len(self._node_set.nodes)
            )
        )
        return True

    def _fail(self, reason: str) -> None:
        self._failed = True
        self._main_queue.ask(reason)

    # --- up and running

    def _keep_up(self) -> None:
        """Deal with what happens until the end is asked for, or the time is over."""
        run_for_s = self._options.run_for_s
        end_s = None if run_for_s is None else time.monotonic() + run_for_s
        while not self._main_queue.closing:
            now_s = time.monotonic()
            due_s = self._supervisor.next_restart_s()
            if end_s is not None and now_s >= end_s:
                self._main_queue.ask(f"{run_for_s:g} s are over")
            elif due_s is not None and now_s >= due_s:
                self._supervisor.restart_due()
            else:
                times = [at_s for at_s in (end_s, due_s) if at_s is not None]
                self._deal_with(self._main_queue.take(min(times, default=None)))

    def _deal_with(self, item: object) -> None:
        match item:
            case Fault():
                self._supervisor.take_fault(item)
            case ExternalTransition():
                self._supervisor.take_move(item)
            case Hanging():
                self._supervisor.take_hanging(item)
            case LoopRecovered():
                self._supervisor.take_return(item)
            case Command():
                self._reporter.tell(events.Commanded(self._reporter.elapsed_s, item.what))
                item.answer(*self._commands.carry_out(item.what))

    def _obey(self, command: Command) -> None:
        """Take a command, on the manager's thread."""
        if command.what == "shutdown":
            self._farewells.append(command)
            self.stop("shutdown, asked for from outside")
        else:
            self._main_queue.put(command)

    def _measure(self) -> None:
        nodes = tuple(self._node_set.nodes.items())
        self._status.measure({name: node.statistics for name, node in nodes})
        self._status.see_states({name: node.state for name, node in nodes})

    def _yield_to(self, namespace: str, host: str, pid: str) -> None:
        if not self._main_queue.closing:
            self._fail(str(already_running(namespace, host, pid)))

    # --- down

    def _limit_end(self) -> None:
        """Limit the time from now to the end of the process, once."""
        if not self._ends:
            self._ends = True
            self._options.end_within(self._options.grace_s)

    def _tear_down(self) -> None:
        if not self._main_queue.closing:
            self._main_queue.ask("it cannot go on")
        self._failed = self._failed or self._supervisor.has_failed_nodes
        self._status.set_activity("stopping")
        self._reporter.tell(events.Stopping(self._reporter.elapsed_s, self._reason))
        if self._leaves_at_once and supports_fast_exit():
            self._node_set.keep_entities()
        stop_within_s = self._options.stop_within_s
        self._end_s = time.monotonic() + stop_within_s
        if self._is_created:
            share_s = _STEP_SHARE * stop_within_s
            if not self._supervisor.tear_down(self._down, self._end_s, share_s):
                self._failed = True
        self._summary = tuple(_summary(node) for node in self._node_set.nodes.values())

    def _close(self, manager: Manager) -> None:
        for item in (*self._farewells, *self._main_queue.rest()):
            if isinstance(item, Command):
                item.answer(item.what == "shutdown", f"the system has stopped: {self._reason}")
            elif isinstance(item, Fault):
                self._failed = True  # nobody has come to deal with it
        self._status.set_activity("stopped")
        end_s = self._end_s
        if self._main_queue.hurry:
            end_s = min(end_s, time.monotonic() + _HURRY_S)
        self._node_set.stop_loops(end_s)
        self._remains = not self._node_set.destroy(end_s)
        self._failed = self._failed or bool(self._node_set.hung)
        manager.retire(linger=bool(self._farewells))
        # A thread that hangs may come back and use what is gone.
        if self._remains and self._options.ends_process and not self._node_set.hung:
            self._has_left = leave_ros_graph()
        if not self._has_left:
            manager.destroy()

    def _outcome(self) -> Outcome:
        return Outcome(
            exit_code=1 if self._failed else 0,
            reason=self._reason,
            elapsed_s=self._reporter.elapsed_s,
            nodes=self._summary,
            hung=self._remains,
            callbacks=self._node_set.callbacks(),
            chains=self._node_set.chains(),
        )

    @property
    def _reason(self) -> str:
        return self._main_queue.reason or ""

    # --- what nodes tell, on the threads of their loops

    def _listener(self, name: str) -> Listener:
        return Listener(
            on_rest=lambda transition, state, cause: self._take_rest(
                name, transition, state, cause
            ),
            on_fault=lambda callback, text: self._take_fault(name, callback, text),
            write_log=self._write_log,
        )

    def _take_rest(
        self, name: str, transition: str, state: str, cause: BaseException | None
    ) -> None:
        at_s = self._reporter.elapsed_s
        self._status.set_state(name, state)
        full_name = self._node_set.nodes[name].full_name
        self._reporter.tell(events.StateChanged(at_s, full_name, transition, state))
        if name in self._supervisor.moving:
            return
        if state == _GOALS[transition]:
            self._main_queue.put(ExternalTransition(name, state))
        elif state in _DOWN:
            text = f"{transition} ended in an error: {describe(cause)}" if cause else transition
            self._main_queue.put(Fault(name, FaultKind.TRANSITION, text, time.monotonic()))

    def _take_fault(self, name: str, callback: str, text: str) -> None:
        self._status.set_error(name, f"{callback}: {text}")
        full_name = self._node_set.nodes[name].full_name
        self._reporter.tell(
            events.CallbackFailed(self._reporter.elapsed_s, full_name, callback, text)
        )

    def _write_log(self, level: LogLevel, logger: str, message: str) -> None:
        self._reporter.tell(events.Logged(self._reporter.elapsed_s, logger, level, message))


def _start_ros() -> None:
    try:
        rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    except rclpy_implementation.RCLError as error:
        raise StartRefused(f"ROS does not start: {error}", "see the lines above") from error


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
