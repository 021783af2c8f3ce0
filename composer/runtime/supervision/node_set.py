"""The nodes of a running system and the loops that run them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from composer.model import (
    PrimaryState,
    System,
)
from composer.model.lifecycle import FINALIZED
from composer.runtime.executors.futures import Future, done_event
from composer.runtime.executors.tracebacks import describe
from composer.runtime.executors.turns import TurnWatch
from composer.runtime.members.node import MemberNode
from composer.runtime.metrics.figures import chain_figures, figures
from composer.runtime.node.interruption import RunningCallback, running_callbacks
from composer.runtime.node.managed_node import ManagedNode, TransitionOutcome
from composer.runtime.node.options import ProcessContext
from composer.runtime.node.parameters import ParameterError
from composer.runtime.process.computer import place_threads
from composer.runtime.protocol.reports import CallbackFigures, ChainFigures
from composer.runtime.supervision.events import COUNTERS, NodeSummary
from composer.runtime.supervision.node_factory import NodeFactory

_PRIMARY_STATES = {state.value: state for state in PrimaryState}
_LOOP_ENDS_WITHIN_S = 0.2
#: Time for a loop to remove the entities of a node, on a busy machine.
_NODE_REMOVED_WITHIN_S = 0.005
_RECREATED_WITHIN_S = 5.0


class CreationFailed(Exception):
    """A node cannot be created. ``node`` is its full name; the text is the reason."""

    def __init__(self, node: str, reason: str) -> None:
        super().__init__(reason)
        self.node = node


class NodeSet:
    """Every node of one system, by its key, and every loop, by the name of its executor."""

    def __init__(self, system: System, factory: NodeFactory) -> None:
        self._system = system
        self._factory = factory
        self._clock = factory.clock
        self.nodes: dict[str, ManagedNode] = {}
        self.loops = factory.loops
        self._turn_watch = TurnWatch(self.loops.values)
        #: The loops with a callback that does not return; their nodes cannot do anything.
        self.hung: set[str] = set()
        #: The other processes of the system, as far as nodes were created in them.
        self.other_processes = factory.other_processes
        #: What the nodes follow.
        self.run_state = factory.run_state
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
        refusal = self._factory.join(process, self.nodes)
        if refusal is not None and self._clock.is_virtual:
            reason = f"virtual time needs topics within the process: {refusal}"
            raise CreationFailed("the system", reason)
        if refusal is not None:
            self.warnings.append(
                "topics within the process use DDS, which takes more CPU time:"
                f" {refusal}; see 'compose doctor', or set 'delivery: dds'"
            )
        if self._clock.is_virtual and self._system.executors:
            names = ", ".join(f"'{executor.name}'" for executor in self._system.executors)
            self.warnings.append(f"in virtual time, one event loop runs the nodes of {names}")
        for node in self._system.nodes:
            before_each()
            try:
                self.nodes[node.name.value] = self._factory.make(node)
            except ParameterError as error:
                raise CreationFailed(node.full_name, str(error)) from error
            except Exception as error:
                reason = f"cannot be created: {describe(error)}"
                raise CreationFailed(node.full_name, reason) from error
        self.other_processes.start_soon()
        for name, loop in self.loops.items():
            loop.start()
            executor = self._factory.executors.get(name)
            if executor is not None:
                self.warnings += place_threads(executor, loop.native_thread_ids())
        has_classes = any(
            node.model.in_process and node.model.hosted_class for node in self.nodes.values()
        )
        if has_classes and not self._clock.is_virtual:
            self._turn_watch.start()

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
        return node.loop.run_task(node.lifecycle.run_step(transition, is_outdated, after))

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

    def summaries(self) -> tuple[NodeSummary, ...]:
        """Return the states and the counters of all nodes."""
        return tuple(map(_summary, self.nodes.values()))

    def chains(self) -> tuple[ChainFigures, ...]:
        """Return the latencies of the chains of the system."""
        return tuple(map(chain_figures, self._factory.chains.statistics))

    def is_lost(self, name: str) -> bool:
        """Return whether the node's loop hangs, so that the node cannot do anything."""
        return self.nodes[name].loop.name in self.hung

    def has_unfinished(self) -> bool:
        """Return whether a node that is not finalized has a loop that hangs."""
        return any(
            self.is_lost(name) and self.nodes[name].state != FINALIZED for name in self.nodes
        )

    def running_callbacks(self, name: str) -> list[RunningCallback]:
        """Return the callbacks that keep the threads of the node's loop busy, one per thread."""
        threads = self.nodes[name].loop.busy_threads()
        return [innermost for innermost, *_ in running_callbacks(threads)]

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
            node.loop.wait(done_event(created), node.transition_timeout_s)
            if not created.done():
                created.cancel()
                return "cannot be created again: its process does not respond"
            return created.result()
        try:
            node.loop.run(partial(self._replace, name, is_outdated), _RECREATED_WITHIN_S)
        except Exception as error:
            return f"cannot be created again: {describe(error)}"
        return None

    def stop_loops(self, end_s: float) -> None:
        """Stop the threads of the nodes until ``end_s`` (monotonic); the others are ``hung``.

        Each gets a minimum of time, also after ``end_s``: on a busy machine, a late thread need not
        hang.
        """
        minimum_s = _LOOP_ENDS_WITHIN_S + _NODE_REMOVED_WITHIN_S * len(self.nodes)
        self._turn_watch.stop()
        for name, loop in self.loops.items():
            left_s = 0.0 if name in self.hung else end_s - self._clock.monotonic()
            if not loop.stop(max(minimum_s, left_s)):
                self.hung.add(name)

    def destroy(self, end_s: float) -> bool:
        """Destroy the nodes until ``end_s`` (monotonic), with their loops stopped.

        Return False if some are left to the end of the process: Fast DDS takes longer for each
        endpoint the more there are, seconds for 100 nodes, and a hung loop never ends.
        """
        self.other_processes.close()
        self._factory.children.close(end_s)
        if self.run_state.keeps_entities:
            return False
        complete = not self.hung
        for name in reversed(self.nodes):
            if self.is_lost(name) or self._clock.monotonic() > end_s:
                complete = False
            else:
                self.nodes[name].destroy()
        return complete

    def _replace(self, name: str, is_outdated: Callable[[], bool]) -> None:
        """Replace a finalized node: here, as another request may have done so by now."""
        old = self.nodes[name]
        if old.state == FINALIZED and not is_outdated():
            old.destroy()
            self.nodes[name] = self._factory.make(old.model, old)


def _take_over(members: Sequence[MemberNode]) -> None:
    for member in members:
        member.take_over()


def _summary(node: ManagedNode) -> NodeSummary:
    counts = {name: node.count(name) for name in COUNTERS}
    is_counted = node.model.in_process or isinstance(node, MemberNode)
    return NodeSummary(node.full_name, node.state, is_counted=is_counted, **counts)
