"""One process that runs one system: bring-up, supervision, tear-down.

::

    from composer.runtime.host import Host
    from composer.runtime.host_options import HostOptions
    from composer.runtime.process import StartRefused

    host = Host(system, bring_up(system), tear_down(system), HostOptions(run_for_s=5.0), report)
    try:
        outcome = host.run()          # on the main thread, where it handles SIGINT and SIGTERM
    except StartRefused as refusal:   # nothing was started; str(refusal), refusal.hint
        ...
    outcome.exit_code, outcome.reason, outcome.nodes   # see composer.runtime.supervision.events
    if outcome.hung: os._exit(outcome.exit_code)       # after flushing

``report(event)`` is called for each event of :mod:`composer.runtime.supervision.events`, from
several threads, one call at a time.
"""

from __future__ import annotations

import gc
import math
import os
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from functools import partial

import rclpy
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import get_rmw_implementation_identifier, try_shutdown

from composer.model import LogLevel, Node, System
from composer.model.names import PROGRAM_LOGGER, join
from composer.plan import Plan
from composer.runtime.children.discovery_server import discovery_servers
from composer.runtime.clock import VirtualClock
from composer.runtime.host_options import HostOptions, TimeLimits
from composer.runtime.intra_process.servers import use_seed
from composer.runtime.manager.node import ManagerNode
from composer.runtime.manager.publishing import ManagerContext
from composer.runtime.middleware.environment import (
    ROS_ARGUMENTS,
    active_variables,
    prepare_environment,
    use_large_system_profile,
)
from composer.runtime.node.managed_node import ManagedNode, NodeListener
from composer.runtime.node.options import ProcessContext
from composer.runtime.process import start_refused
from composer.runtime.process.computer import (
    memory_excess,
    place_threads,
    switch_threads_sooner,
)
from composer.runtime.process.instance_lock import already_running, hold_instance_lock
from composer.runtime.process.signals import WakeupSocket, stop_signals
from composer.runtime.process.watchdog import signal_watchdog
from composer.runtime.protocol.reports import ChainFigures
from composer.runtime.protocol.requests import Instance
from composer.runtime.ros.message_sizes import sends_large_messages
from composer.runtime.supervision import events
from composer.runtime.supervision.commands import Commands
from composer.runtime.supervision.events import Outcome, Report, Reporter
from composer.runtime.supervision.health_monitor import HealthMonitor
from composer.runtime.supervision.main_queue import (
    Command,
    Item,
    MainQueue,
    SupervisionContext,
    SupervisionListener,
)
from composer.runtime.supervision.node_factory import NodeFactory
from composer.runtime.supervision.node_set import CreationFailed, NodeSet
from composer.runtime.supervision.reconciler import Reconciler
from composer.runtime.supervision.start_and_end import SystemEnd, SystemStart
from composer.runtime.supervision.status import Status
from composer.runtime.supervision.supervisor import Supervisor
from composer.runtime.supervision.virtual_time import (
    ISOLATION,
    check_virtual_time,
    watched_time,
)

_KEY_BYTES = 32


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
        self._options = options or HostOptions()
        self._clock = self._options.clock
        self._main_queue: MainQueue[Item] = MainQueue(self._clock)
        self._reporter = Reporter(report, self._clock, self._options.started_at_s)
        key = self._options.report_key
        self._status = Status(system, self._clock, is_child=bool(key))
        is_member = self._options.process is not None
        self._report_key = key or (os.urandom(_KEY_BYTES).hex() if is_member else "")
        factory = NodeFactory(
            *(system, self._make_listener, self._options),
            *(self._reporter.log, self._main_queue.together),
        )
        self._node_set = NodeSet(system, factory)
        self._context = context = SupervisionContext(
            *(system, self._node_set, self._main_queue, self._status, self._reporter)
        )
        self._supervisor = Supervisor(Reconciler(context))
        self._commands = Commands(context, self._supervisor)
        self._start = SystemStart(
            *(context, self._supervisor, up, self._run_command, self._options.all_or_nothing)
        )
        self._end = SystemEnd(down, self._supervisor, self._options)
        self._limits = TimeLimits(self._options)
        self._is_created = False
        self._shutdown_commands: list[Command] = []

    def stop(self, reason: str) -> None:
        """Request a stop, from any thread or a signal handler. A second request is urgent."""
        self._limits.limit_end()
        self._main_queue.request_stop(reason)

    @property
    def nodes(self) -> Mapping[str, ManagedNode]:
        """The nodes that have been created, by their keys."""
        return self._node_set.nodes

    def chains(self) -> tuple[ChainFigures, ...]:
        """Return the latencies of the chains of the system so far."""
        return self._node_set.chains()

    def run(self) -> Outcome:
        """Bring the system up, supervise it until it has to stop, and tear it down.

        Raises StartRefused if the environment does not allow a start, or the system runs already.
        """
        self._prepare_clock()
        is_isolated = self._clock.is_isolated
        discovery = None if is_isolated else self._system.discovery
        prepare_environment(discovery)
        if self._end.uses_fast_exit:
            use_large_system_profile(os.environ)
        if discovery is not None and discovery.interfaces:
            from composer.runtime.middleware.dds_xml import use_interfaces  # noqa: PLC0415 - slow, rare

            self._node_set.warnings += use_interfaces(discovery, os.environ)
        namespace = join(self._system.namespace, self._system.name.value)
        ends_process = self._options.ends_process
        signals = stop_signals(self.stop, self._main_queue.wakeup, ends_process=ends_process)
        if ends_process:  # the process is not that of a program that runs a system
            switch_threads_sooner()
        if self._options.process is not None:
            self._node_set.warnings += place_threads(self._options.process)
        queue = self._main_queue
        wait = partial(queue.wait, lambda: queue.stopping, stoppable=True)
        servers = discovery_servers(discovery, os.environ, self._reporter.log, wait)
        variables = active_variables(discovery, os.environ)
        watched: AbstractContextManager[None] = nullcontext()
        if isinstance(self._clock, VirtualClock):
            parts = (self._clock, self._node_set, lambda: queue.stopping)
            watched = watched_time(*parts, self._warn, self._fail)
        lock: AbstractContextManager[None] = nullcontext()
        if not is_isolated:  # otherwise the same system may run at the same time
            lock = hold_instance_lock(namespace, variables, self._report_key)
        with lock, signals, servers, watched:
            self._limits.limit_start()
            try:
                with self._segment():
                    manager = self._join(namespace)
                self._run(manager)
            finally:
                if ends_process:
                    gc.unfreeze()
                if not self._end.has_left_graph:  # otherwise there is nothing left to shut down
                    try_shutdown()
        return self._end.outcome()

    def _prepare_clock(self) -> None:
        """Prepare what the time of the run asks for. Raises StartRefused."""
        seed = self._options.seed
        if self._clock.is_virtual:
            check_virtual_time(self._system)
            seed = seed or 0
        if self._clock.is_isolated:
            os.environ.update(ISOLATION)
        if seed is not None:
            use_seed(seed)

    def _segment(self) -> AbstractContextManager[None]:
        """Return the block in which this process joins the ROS graph."""
        if not sends_large_messages(self._system):
            return nullcontext()
        from composer.runtime.middleware.dds_xml import (  # noqa: PLC0415 - slow, rare
            segment_for_large_messages,
        )

        rmw = get_rmw_implementation_identifier()
        return segment_for_large_messages(os.environ, rmw, self._warn)

    def _join(self, namespace: str) -> ManagerNode:
        """Join the ROS graph, as the first node of a process does."""
        _start_ros()
        context = ManagerContext(
            status=self._status,
            report_key=self._report_key,
            on_command=self._on_command,
            on_older_instance=partial(self.on_older_instance, namespace),
            update_status=self._update_status,
            callbacks=self._node_set.callbacks,
            chains=self._node_set.chains,
            nodes=lambda: {node.full_name: node for node in tuple(self._node_set.nodes.values())},
            recreate=self._recreate,
            expect_end=self._end.keep_entities,
            save_recording=self._save_recording,
            write_log=self._reporter.log,
        )
        try:
            return ManagerNode(namespace, context, use_sim_time=self._system.use_sim_time)
        except rclpy_implementation.RCLError as error:
            raise start_refused(error) from error

    def _run(self, manager: ManagerNode) -> None:
        try:
            if self._create(manager.process_context):
                with self._watchdog():
                    self._bring_up_and_supervise()
        finally:
            self._limits.limit_end()
            self._end.tear_down(is_created=self._is_created)
            self._end.destroy(self._shutdown_commands)
            manager.retire(linger=bool(self._shutdown_commands))
            if not self._end.leave_graph():
                manager.destroy()

    def _watchdog(self) -> AbstractContextManager[None]:
        """Return the block in which the main thread reads signals from its socket at once.

        What comes before and after has time limits of its own, and reads them late.
        """
        wakeup = self._main_queue.wakeup
        if not self._options.ends_process or not isinstance(wakeup, WakeupSocket):
            return nullcontext()
        return signal_watchdog(wakeup.read_fd, self._options.grace_s)

    def _longest_bring_up_s(self) -> float:
        """Return how long it may take, one step after the other, and the same for a roll-back.

        Unless it is all or nothing, nodes that fail are restarted, as often as their policies say.
        """
        nodes = self._node_set.nodes
        steps_s = sum(nodes[step.node].transition_timeout_s for step in self._up.steps)
        once_s = steps_s if self._options.all_or_nothing else math.inf
        return min(once_s, self._options.bring_up_within_s) + steps_s

    def _make_listener(self, node: Node) -> NodeListener:
        return SupervisionListener(node, self._context)

    def _create(self, process: ProcessContext) -> bool:
        try:
            self._node_set.create(process, self._limits.limit_start)
            self._limits.limit_phase(self._longest_bring_up_s())
        except CreationFailed as error:
            self._reporter.report(events.RollingBack, error.node, str(error))
            self._fail(f"{error.node} failed")
            return False
        for warning in self._node_set.warnings:
            self._warn(warning)
        if self._options.ends_process:
            # What is there now stays to the end. A search for reference cycles in it takes 0.1 s.
            gc.freeze()
            gc.enable()
        self._is_created = True
        self._update_status()  # reports of the first second have counters, too
        return True

    def _bring_up_and_supervise(self) -> None:
        monitor = HealthMonitor(self._context)
        monitor.start()
        try:
            if self._bring_up():
                self._node_set.run_state.is_up = True
                self._supervise()
        finally:
            self._limits.limit_end()
            monitor.stop()

    def _bring_up(self) -> bool:
        problem = self._start.run(self._options.bring_up_within_s)
        if problem is not None:
            self._fail(problem)
        return not self._main_queue.stopping

    def _supervise(self) -> None:
        run_for_s = math.inf if self._options.run_for_s is None else self._options.run_for_s
        self._limits.limit_phase(run_for_s)
        self._supervisor.run(self._run_command, self._clock.monotonic() + run_for_s)
        if not self._main_queue.stopping:
            self._main_queue.request_stop("--for elapsed")

    def _run_command(self, command: Command) -> None:
        self._reporter.report(events.Commanded, command.name, command.nodes)
        command.answer(*self._commands.run(command))

    def _warn(self, text: str) -> None:
        self._reporter.log(LogLevel.WARN, PROGRAM_LOGGER, text)

    def _fail(self, reason: str) -> None:
        self._end.has_failed = True
        self._main_queue.request_stop(reason)

    # --- callbacks of the manager node, on its thread

    def _on_command(self, command: Command) -> None:
        if command.name == "shutdown":
            self._shutdown_commands.append(command)
            self.stop("shutdown requested")
        else:
            self._main_queue.put(command)

    def _recreate(self, node: ManagedNode) -> str | None:
        name = node.model.name.value
        problem = self._node_set.recreate(name, lambda: False)
        self._status.update_states({name: self._node_set.nodes[name].state})
        return problem

    def _save_recording(self, done: Callable[[bool, str], None]) -> None:
        if self._options.recorder is None:
            done(False, "it does not record: its file has no 'recording'")
        else:
            self._options.recorder.save(done)

    def on_older_instance(self, namespace: str, instance: Instance) -> None:
        """End the run, because the system already runs elsewhere; its nodes stay as they are."""
        self._node_set.run_state.leaves_others = True
        if not self._main_queue.stopping:
            self._fail(str(already_running(namespace, instance.host, instance.pid)))

    def _update_status(self) -> None:
        self._options.on_alive()
        nodes = dict(self._node_set.nodes)
        self._status.measure(nodes)
        self._status.update_states({name: node.state for name, node in nodes.items()})
        excess = None if self._options.process is None else memory_excess(self._options.process)
        if excess is not None and not self._main_queue.stopping:
            self._reporter.log(LogLevel.ERROR, PROGRAM_LOGGER, excess)
            self._fail(excess)


def _start_ros() -> None:
    try:
        rclpy.init(args=list(ROS_ARGUMENTS), signal_handler_options=SignalHandlerOptions.NO)
    except rclpy_implementation.RCLError as error:
        raise start_refused(error) from error
