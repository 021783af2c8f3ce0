"""The nodes of a running system and the loops that run them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

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
from composer.runtime.callbacks.log import describe
from composer.runtime.callbacks.mutation_check import SeenMessages
from composer.runtime.executors.factory import log_exception, make_loop
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.thread_placement import place
from composer.runtime.intra_process.eligibility import shared_channels
from composer.runtime.intra_process.router import Delivery
from composer.runtime.metrics.figures import CallbackFigures, ChainFigures, chain_figures, figures
from composer.runtime.metrics.statistics import Statistics
from composer.runtime.node.node import Listener, NodeOptions, RunningNode, Shared
from composer.runtime.node.parameters import ParameterError
from composer.source import Located

_PRIMARY = {state.value: state for state in PrimaryState}
FINALIZED = "finalized"
_LOOP_ENDS_WITHIN_S = 0.2
#: A loop lets go of everything that its nodes have; on a busy machine that takes up to so long.
_NODE_IS_LET_GO_WITHIN_S = 0.005
_MADE_ANEW_WITHIN_S = 5.0


class CreationFailed(Exception):
    """A node cannot be created. ``node`` is its full name; the text says why."""

    def __init__(self, node: str, reason: str) -> None:
        super().__init__(reason)
        self.node = node


@dataclass(frozen=True, slots=True)
class NodeSetOptions:
    """How all nodes are run.

    ``transition_timeout_s`` goes before what the system says; ``tracing`` is whether the times of
    callbacks are taken; ``check_mutation`` whether it is looked for who changes messages.
    """

    log_level: LogLevel
    transition_timeout_s: float | None
    tracing: bool
    check_mutation: bool


class NodeSet:
    """Every node of one system, by its key, and every loop, by the name of its executor."""

    def __init__(
        self,
        system: System,
        listen: Callable[[str], Listener],
        options: NodeSetOptions,
    ) -> None:
        """``listen(key)`` is who is told what a node does."""
        self._system = system
        self._listen = listen
        self._options = options
        self._seen_messages = SeenMessages() if options.check_mutation else None
        self._executors = {executor.name.value: executor for executor in system.executors}
        self._delivery = Delivery({})
        self._chains = Chains(system, tracing=options.tracing)
        self._shared: Shared  # which is known once nodes are created
        self.nodes: dict[str, RunningNode] = {}
        self.loops: dict[str, Loop] = {}
        #: The loops with a callback that does not return; nothing can be asked of their nodes.
        self.hung: set[str] = set()
        self._keeps_entities = False
        #: Where nodes are as far as the main thread knows, which moves them; by their keys.
        self.left: dict[str, str] = {}
        #: What Linux refuses to executors and the middleware to topics, each with what would help.
        self.refusals: list[str] = []

    def create(self, shared: Shared, begin: Callable[[], None] = lambda: None) -> None:
        """Create all nodes and start their loops. Raises CreationFailed; nothing is started then.

        A node that cannot be created leaves those before it to be closed. ``begin`` is called
        before each of them.
        """
        self._shared = shared
        self._delivery = Delivery(shared_channels(self._system))
        if self._delivery.refusal is not None:
            self.refusals.append(
                f"topics within the process go by DDS, which costs more: {self._delivery.refusal};"
                " 'compose doctor' says what helps, 'delivery: dds' that it is meant"
            )
        for node in self._system.nodes:
            begin()
            try:
                self.nodes[node.name.value] = self._make(node)
            except ParameterError as error:
                raise CreationFailed(node.full_name, str(error)) from error
            except Exception as error:
                reason = f"it cannot be created: {describe(error)}"
                raise CreationFailed(node.full_name, reason) from error
        for name, loop in self.loops.items():
            loop.start()
            if name in self._executors:
                self.refusals += place(self._executors[name], loop.thread_ids())

    def timeout_s(self, name: str) -> float:
        """Return how long a transition of a node may take."""
        return self._timeout_s(self.nodes[name].model)

    def states(self) -> Mapping[str, PrimaryState]:
        """Return the states of all nodes that can be moved, by their keys.

        Nodes that are finalized, in mid-transition or on a hung loop are left out.
        """
        return {
            name: _PRIMARY[node.state]
            for name, node in self.nodes.items()
            if node.loop.name not in self.hung and node.state in _PRIMARY
        }

    def settled(self) -> Mapping[str, PrimaryState]:
        """Return the states of nodes that nobody else has moved; of others news is on its way."""
        return {
            name: state
            for name, state in self.states().items()
            if self.left.get(name, state.value) == state.value
        }

    def callbacks(self) -> tuple[CallbackFigures, ...]:
        """Return what the callbacks of all nodes took so far."""
        return tuple(
            figures(node.full_name, callback)
            for node in tuple(self.nodes.values())
            for callback in tuple(node.statistics.callbacks.values())
        )

    def chains(self) -> tuple[ChainFigures, ...]:
        """Return how long data was on the chains of the system."""
        return tuple(map(chain_figures, self._chains.statistics))

    def is_lost(self, name: str) -> bool:
        """Say whether nothing can be asked of the node, since its loop hangs."""
        return self.nodes[name].loop.name in self.hung

    def active(self) -> int:
        """Return how many nodes are active."""
        return sum(node.state == PrimaryState.ACTIVE.value for node in self.nodes.values())

    def revive(self, name: str) -> None:
        """Make a finalized node anew, unconfigured: there is no way back from *finalized*.

        Raises CreationFailed.
        """
        old = self.nodes[name]
        if old.state != FINALIZED:
            return
        try:
            self.nodes[name] = old.loop.run(partial(self._remake, old), _MADE_ANEW_WITHIN_S)
            self.left[name] = PrimaryState.UNCONFIGURED.value
        except Exception as error:
            reason = f"it cannot be made anew: {describe(error)}"
            raise CreationFailed(old.full_name, reason) from error

    def keep_entities(self) -> None:
        """Let no node give anything back from now on: the process ends, and all goes with it."""
        self._keeps_entities = True
        for node in self.nodes.values():
            node.keep_entities()

    def stop_loops(self, end_s: float) -> None:
        """End the threads of the nodes. What cannot be ended is in ``hung`` then.

        They have until ``time.monotonic()`` says ``end_s``: a thread that a busy machine lets wait
        does not hang. What is known to hang, and what is late, gets a moment.
        """
        moment_s = _LOOP_ENDS_WITHIN_S + _NODE_IS_LET_GO_WITHIN_S * len(self.nodes)
        for name, loop in self.loops.items():
            left_s = 0.0 if name in self.hung else end_s - time.monotonic()
            if not loop.stop(max(moment_s, left_s)):
                self.hung.add(name)

    def destroy(self, end_s: float) -> bool:
        """Give the nodes back, with the loops stopped, until ``time.monotonic()`` says ``end_s``.

        False when something is left that only the end of the process removes: Fast DDS takes longer
        for each endpoint the more there are, seconds for 100 nodes, and a hung loop never ends.
        """
        if self._keeps_entities:
            return False
        complete = not self.hung
        for name in reversed(self.nodes):
            if self.is_lost(name) or time.monotonic() > end_s:
                complete = False
            else:
                self.nodes[name].destroy()
        return complete

    def _remake(self, old: RunningNode) -> RunningNode:
        old.destroy()
        return self._make(old.model, old)

    def _make(self, node: Node, before: RunningNode | None = None) -> RunningNode:
        executor = self._executor_of(node)
        name = executor.name.value
        if name not in self.loops:
            self.loops[name] = make_loop(executor, _take_exception)
        options = NodeOptions(
            chains=self._chains,
            delivery=self._delivery,
            shared=self._shared,
            seen_messages=self._seen_messages,
            parallel=executor.kind is ExecutorKind.MULTI_THREADED,
            log_level=self._options.log_level,
            transition_timeout_s=self._timeout_s(node),
        )
        statistics = (
            Statistics(tracing=self._options.tracing) if before is None else before.statistics
        )
        return RunningNode(
            node, self.loops[name], options, self._listen(node.name.value), statistics
        )

    def _timeout_s(self, node: Node) -> float:
        before_all = self._options.transition_timeout_s
        return node.supervision.timeout_ms / 1000.0 if before_all is None else before_all

    def _executor_of(self, node: Node) -> Executor:
        """Return the executor the node runs on; without one it is ``default``, an event loop."""
        if node.executor is not None:
            return self._executors[node.executor.value]
        return self._executors.get(DEFAULT_EXECUTOR) or Executor(
            Located(DEFAULT_EXECUTOR, node.span), ExecutorKind.EVENTS, node.span
        )


def _take_exception(what: str, error: BaseException) -> None:
    """Log what leaves a callback; that a call ended with its node is nothing to tell."""
    if not isinstance(error, CallCancelled):
        log_exception(what, error)
