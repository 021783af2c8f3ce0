"""The nodes of a running system and the loops that run them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from typing import Any

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located
from composer.behavior import CallCancelled
from composer.model import (
    DEFAULT_EXECUTOR,
    Executor,
    ExecutorKind,
    LogLevel,
    Node,
    PrimaryState,
    System,
)
from composer.runtime.callbacks.chains import Chains
from composer.runtime.callbacks.log import Write
from composer.runtime.callbacks.mutation_check import MessageSnapshots
from composer.runtime.children.child_processes import ChildProcesses
from composer.runtime.executors.exceptions import describe, log_exception
from composer.runtime.executors.futures import Future
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.placement import place_threads
from composer.runtime.executors.turns import TurnWatch
from composer.runtime.hosting.behavior_node import NodeOfBehavior
from composer.runtime.hosting.hosted_node import HostedNode
from composer.runtime.intra_process.router import LocalRouter, shared_channels
from composer.runtime.members.node import MemberNode
from composer.runtime.members.other_processes import OtherProcesses
from composer.runtime.metrics.figures import CallbackFigures, ChainFigures, chain_figures, figures
from composer.runtime.metrics.statistics import Statistics
from composer.runtime.node.managed_node import (
    FINALIZED,
    ManagedNode,
    NodeListener,
    TransitionOutcome,
)
from composer.runtime.node.node import RunningNode
from composer.runtime.node.options import NodeOptions, ProcessContext
from composer.runtime.node.parameters import ParameterError
from composer.runtime.outside_nodes.executable_node import ExecutableNode
from composer.runtime.outside_nodes.external_node import ExternalNode
from composer.runtime.outside_nodes.outside_node import OutsideContext, OutsideNode
from composer.runtime.supervision.events import COUNTERS, NodeSummary
from composer.runtime.supervision.interruption import RunningCallback, running_callbacks

_PRIMARY_STATES = {state.value: state for state in PrimaryState}
#: The loop on which all nodes outside the process are driven.
_OUTSIDE = "nodes outside the process"
_LOOP_ENDS_WITHIN_S = 0.2
#: Time for a loop to remove the entities of a node, on a busy machine.
_NODE_REMOVED_WITHIN_S = 0.005
_RECREATED_WITHIN_S = 5.0


class CreationFailed(Exception):
    """A node cannot be created. ``node`` is its full name; the text is the reason."""

    def __init__(self, node: str, reason: str) -> None:
        super().__init__(reason)
        self.node = node


@dataclass(frozen=True, slots=True)
class NodeSetOptions:
    """How all nodes are run.

    ``transition_timeout_s`` overrides the system's; ``tracing`` records callback timings;
    ``check_mutation`` checks whether callbacks change messages. ``namespace`` is that of the
    manager, ``member_command`` starts the other processes of the system, which are only awaited
    without it, and ``write_log`` receives what they print. What nodes report within the context
    manager ``together`` is handled together.
    """

    log_level: LogLevel
    transition_timeout_s: float | None
    tracing: bool
    check_mutation: bool
    namespace: str = ""
    member_command: Sequence[str] = ()
    write_log: Write = lambda *_: None
    together: Callable[[], AbstractContextManager[None]] = nullcontext


class NodeSet:
    """Every node of one system, by its key, and every loop, by the name of its executor."""

    def __init__(
        self,
        system: System,
        make_listener: Callable[[Node], NodeListener],
        options: NodeSetOptions,
    ) -> None:
        """``make_listener(node)`` returns the listener of a node."""
        self._system = system
        self._make_listener = make_listener
        self._options = options
        self._seen_messages = MessageSnapshots() if options.check_mutation else None
        self._executors = {executor.name.value: executor for executor in system.executors}
        self._router = LocalRouter({})
        self._chains = Chains(system, tracing=options.tracing)
        self._process: ProcessContext  # set by create()
        self.nodes: dict[str, ManagedNode] = {}
        self.loops: dict[str, Loop] = {}
        self._turn_watch = TurnWatch(self.loops.values)
        #: The loops with a callback that does not return; their nodes cannot do anything.
        self.hung: set[str] = set()
        self._keeps_entities = False
        self._children = ChildProcesses()
        #: The other processes of the system, as far as nodes were created in them.
        self.other_processes = OtherProcesses(
            system,
            options.namespace,
            options.member_command,
            options.write_log,
            options.together,
        )
        #: The names of the other processes, by the keys of the nodes that they run.
        self.process_of: Mapping[str, str] = {
            node.name.value: node.process.value for node in system.nodes if node.process is not None
        }
        #: What Linux or the middleware does not allow, each with a hint.
        self.warnings: list[str] = []

    def create(self, process: ProcessContext, before_each: Callable[[], None]) -> None:
        """Create all nodes, then start their loops; call ``before_each`` before each node.

        Raises CreationFailed. Then no loop runs, and the nodes created until then remain.
        """
        self._process = process
        self._router = LocalRouter(shared_channels(self._system))
        if self._router.refusal is not None:
            self.warnings.append(
                "topics within the process use DDS, which takes more CPU time:"
                f" {self._router.refusal}; see 'compose doctor', or set 'delivery: dds'"
            )
        for node in self._system.nodes:
            before_each()
            try:
                self.nodes[node.name.value] = self._make(node)
            except ParameterError as error:
                raise CreationFailed(node.full_name, str(error)) from error
            except Exception as error:
                reason = f"cannot be created: {describe(error)}"
                raise CreationFailed(node.full_name, reason) from error
        self.other_processes.start_soon()
        for name, loop in self.loops.items():
            loop.start()
            if name in self._executors:
                self.warnings += place_threads(self._executors[name], loop.native_thread_ids())
        if any(node.model.in_process and node.model.hosted_class for node in self.nodes.values()):
            self._turn_watch.start()

    def timeout_s(self, name: str) -> float:
        """Return the time limit of a node's transitions."""
        return self.nodes[name].transition_timeout_s

    def states(self) -> Mapping[str, PrimaryState]:
        """Return the states of the nodes that can be moved, by their keys.

        Nodes that are finalized, in a transition, or on a hung loop cannot.
        """
        states = {name: node.state for name, node in self.nodes.items() if not self.is_lost(name)}
        return {
            name: _PRIMARY_STATES[state]
            for name, state in states.items()
            if state in _PRIMARY_STATES
        }

    def run_step(
        self,
        name: str,
        transition: str,
        is_outdated: Callable[[], bool],
        after: Sequence[str] = (),
    ) -> Future[TransitionOutcome]:
        """Run a step of a plan, see :meth:`.ManagedLifecycle.run_step`.

        A node of another process may have to wait for nodes of the same one, ``after``.
        """
        node = self.nodes[name]
        if isinstance(node, MemberNode):
            return node.loop.run_task(node.run_step_after(after, transition, is_outdated))
        return node.loop.run_task(node.lifecycle.run_step(transition, is_outdated))

    def take_over(self) -> None:
        """Use the nodes of other processes in the states in which they are."""
        members = [node for node in self.nodes.values() if isinstance(node, MemberNode)]
        if members:  # all have the same loop
            members[0].loop.run(lambda: _take_over(members))

    def callbacks(self) -> tuple[CallbackFigures, ...]:
        """Return the timings of the callbacks of all nodes so far."""
        return tuple(
            figures(node.full_name, callback)
            for node in tuple(self.nodes.values())
            for callback in tuple(node.statistics.callbacks.values())
        )

    def reported_figures(self) -> Mapping[str, Mapping[str, Any]]:
        """Return what is known of the nodes outside the process, by fields of ``NodeStatus``."""
        nodes = tuple(self.nodes.items())
        return {name: node.figures for name, node in nodes if isinstance(node, OutsideNode)}

    def summaries(self) -> tuple[NodeSummary, ...]:
        """Return the states and the counters of all nodes."""
        return tuple(map(_summary, self.nodes.values()))

    def chains(self) -> tuple[ChainFigures, ...]:
        """Return the latencies of the chains of the system."""
        return tuple(map(chain_figures, self._chains.statistics))

    def is_lost(self, name: str) -> bool:
        """Return whether the node's loop hangs, so that the node cannot do anything."""
        return self.nodes[name].loop.name in self.hung

    def has_unfinished(self) -> bool:
        """Return whether a node that is not finalized has a loop that hangs."""
        return any(
            self.is_lost(name) and self.nodes[name].state != FINALIZED for name in self.nodes
        )

    def is_absent(self, name: str) -> bool:
        """Return whether the node is not there, and something else has to start it."""
        node = self.nodes[name]
        return isinstance(node, OutsideNode) and node.is_absent

    def running_callbacks(self, name: str) -> list[RunningCallback]:
        """Return the callbacks that keep the threads of the node's loop busy, one per thread."""
        return [innermost for innermost, *_ in running_callbacks(self.nodes[name].loop)]

    def active(self) -> int:
        """Return the number of active nodes."""
        return sum(node.state == PrimaryState.ACTIVE.value for node in self.nodes.values())

    def recreate(self, name: str, is_outdated: Callable[[], bool]) -> str | None:
        """Replace a finalized node by a new one: no transition leaves *finalized*.

        A node of another process is created again there.

        If ``is_outdated()`` on the loop of the node, do nothing. Return why the node cannot be
        created, or None.
        """
        node = self.nodes[name]
        if node.state != FINALIZED:
            return None
        if isinstance(node, MemberNode):
            created = node.loop.run_task(node.create_again(is_outdated))
            if not node.loop.wait_for(created, node.transition_timeout_s):
                created.cancel()
                return "cannot be created again: its process does not respond"
            return created.result()
        try:
            node.loop.run(partial(self._replace, name, is_outdated), _RECREATED_WITHIN_S)
        except Exception as error:
            return f"cannot be created again: {describe(error)}"
        return None

    def leave_others(self) -> None:
        """Leave nodes alone that were not started here. Thread-safe."""
        self.other_processes.leave()
        for node in tuple(self.nodes.values()):
            if isinstance(node, ExternalNode):
                node.leave()

    def limit_end(self, end_s: float) -> None:
        """Pass on that the system shuts down until ``end_s`` (monotonic)."""
        for node in self.nodes.values():
            node.limit_end(end_s)
        self.other_processes.limit_end()

    def keep_entities(self) -> None:
        """Do not destroy entities from now on: the end of the process does."""
        self._keeps_entities = True
        for node in self.nodes.values():
            node.keep_entities()

    def stop_loops(self, end_s: float) -> None:
        """Stop the threads of the nodes until ``end_s`` (monotonic); the others are ``hung``.

        Each gets a minimum of time, also after ``end_s``: on a busy machine, a late thread need not
        hang.
        """
        minimum_s = _LOOP_ENDS_WITHIN_S + _NODE_REMOVED_WITHIN_S * len(self.nodes)
        self._turn_watch.stop()
        for name, loop in self.loops.items():
            left_s = 0.0 if name in self.hung else end_s - time.monotonic()
            if not loop.stop(max(minimum_s, left_s)):
                self.hung.add(name)

    def destroy(self, end_s: float) -> bool:
        """Destroy the nodes until ``end_s`` (monotonic), with their loops stopped.

        Return False if some are left to the end of the process: Fast DDS takes longer for each
        endpoint the more there are, seconds for 100 nodes, and a hung loop never ends.
        """
        self.other_processes.close()
        self._children.close(end_s)
        if self._keeps_entities:
            return False
        complete = not self.hung
        for name in reversed(self.nodes):
            if self.is_lost(name) or time.monotonic() > end_s:
                complete = False
            else:
                self.nodes[name].destroy()
        return complete

    def _replace(self, name: str, is_outdated: Callable[[], bool]) -> None:
        """Replace a finalized node: here, as another request may have done so by now."""
        old = self.nodes[name]
        if old.state == FINALIZED and not is_outdated():
            old.destroy()
            self.nodes[name] = self._make(old.model, old)

    def _make(self, node: Node, before: ManagedNode | None = None) -> ManagedNode:
        statistics = (
            Statistics(tracing=self._options.tracing) if before is None else before.statistics
        )
        if not node.in_process:
            return self._make_outside(node, statistics)
        executor = self._executor_of(node)
        options = NodeOptions(
            chains=self._chains,
            router=self._router,
            process=self._process,
            seen_messages=self._seen_messages,
            log_level=self._log_level_of(node),
            transition_timeout_s=self._timeout_s(node),
            system_is_up=before is not None,
            make_library_node=partial(
                NodeOfBehavior, level=self._log_level_of(node), parameters={}
            ),
        )
        loop = self._loop_of(executor)
        kind = RunningNode if node.hosted_class is None else HostedNode
        return kind(node, loop, options, self._make_listener(node), statistics)

    def _make_outside(self, node: Node, statistics: Statistics) -> ManagedNode:
        name = Located(_OUTSIDE, node.span)
        context = OutsideContext(
            loop=self._loop_of(Executor(name, ExecutorKind.EVENTS, node.span)),
            manager=self._process.manager,
            children=self._children,
            listener=self._make_listener(node),
            statistics=statistics,
            timeout_s=self._timeout_s(node),
            log_level=self._log_level_of(node),
        )
        if node.process is not None:
            process = self.other_processes.process(
                node.process.value, context.loop, self._process, self._children
            )
            return MemberNode(node, process, context)
        if node.external is not None:
            return ExternalNode(node, node.external, context)
        if node.executable is not None:
            return ExecutableNode(node, node.executable, context)
        raise AssertionError(f"{node.full_name} runs in this process")

    def _loop_of(self, executor: Executor) -> Loop:
        name = executor.name.value
        if name not in self.loops:
            self.loops[name] = Loop(name, _log_exception, executor.kind, executor.threads)
        return self.loops[name]

    def _timeout_s(self, node: Node) -> float:
        override_s = self._options.transition_timeout_s
        return node.supervision.timeout_ms / 1000.0 if override_s is None else override_s

    def _log_level_of(self, node: Node) -> LogLevel:
        return self._options.log_level if node.log_level is None else node.log_level.value

    def _executor_of(self, node: Node) -> Executor:
        """Return the executor that runs the node: by default ``default``, an event loop.

        A hosted class has an event loop of its own by default: its callbacks may block.
        """
        if node.executor is not None:
            return self._executors[node.executor.value]
        if node.hosted_class is not None:
            name = Located(node.full_name, node.span)
            return Executor(name, ExecutorKind.EVENTS, node.span)
        return self._executors.get(DEFAULT_EXECUTOR) or Executor(
            Located(DEFAULT_EXECUTOR, node.span), ExecutorKind.EVENTS, node.span
        )


def _take_over(members: Sequence[MemberNode]) -> None:
    for member in members:
        member.take_over()


def _summary(node: ManagedNode) -> NodeSummary:
    if isinstance(node, MemberNode):
        counts = {name: node.counts.get(name, 0) for name in COUNTERS}
        return NodeSummary(node.full_name, node.state, is_counted=True, **counts)
    counts = {name: getattr(node.statistics, name) for name in COUNTERS}
    is_counted = node.model.in_process
    return NodeSummary(node.full_name, node.state, is_counted=is_counted, **counts)


def _log_exception(what: str, error: BaseException) -> None:
    """Log an exception that leaves a callback, unless its node was only deactivated."""
    if not isinstance(error, CallCancelled):
        log_exception(what, error)
