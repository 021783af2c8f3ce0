"""Simulated nodes, without ROS and threads, for the property of supervision.

Wherever another thread could run, some requests come first.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, TypeAlias, TypeVar, cast

from hypothesis import strategies as st

from composer.model import Node, PrimaryState
from composer.model.dependencies import dependency_edges
from composer.model.lifecycle import FINALIZED
from composer.plan import Fault
from composer.runtime.clock import COMPUTER
from composer.runtime.executors.futures import Future
from composer.runtime.members.kept_goals import KeptGoals
from composer.runtime.node.managed_node import TransitionOutcome
from composer.runtime.supervision.main_queue import (
    Item,
    MainQueue,
    NodeReturned,
    StepEnded,
    SupervisionListener,
)
from tests.unit.support.resolving import system_of

T = TypeVar("T")

ROBOT = """
system: robot
lifecycle:
  on_failure: restart
  restart: {max_attempts: 1000, backoff_ms: 1, backoff_max_ms: 1}
nodes:
  logger: {lifecycle: {depends_on: {planner: inactive}}}
  motor: {lifecycle: {depends_on: [planner]}}
  planner: {lifecycle: {depends_on: [sensor], on_failure: isolate}}
  sensor: {}
  arm: {lifecycle: {restart: {max_attempts: 2}}}
  camera: {lifecycle: {on_failure: ignore}}
  viewer: {lifecycle: {depends_on: [camera], on_failure: isolate}}
  operator: {external: true, required: false, lifecycle: {on_failure: shutdown}}
  teleop: {class: "teleop:Teleop", lifecycle: {depends_on: [operator]}}
"""
#: The nodes, and those that depend on them.
SYSTEM = system_of(ROBOT)
DEPENDENTS = {
    "sensor": ("planner", "motor", "logger"),
    "planner": ("motor", "logger"),
    "motor": (),
    "logger": (),
    "arm": (),
    "camera": ("viewer",),
    "viewer": (),
    "operator": ("teleop",),
    "teleop": (),
}
EXTERNAL = "operator"
NAMES = tuple(DEPENDENTS)
GOALS = {
    "configure": "inactive",
    "activate": "active",
    "deactivate": "inactive",
    "cleanup": "unconfigured",
    "shutdown": FINALIZED,
}
TRANSITIONS = {
    "unconfigured": ("configure", "configure", "shutdown"),
    "inactive": ("activate", "cleanup", "shutdown"),
    "active": ("deactivate", "deactivate", "shutdown"),
}
STATES = {state.value: state for state in PrimaryState}


@dataclass(frozen=True)
class Request:
    """Begin a transition of a node, or end the one that runs; ``choice`` selects it."""

    node: str
    choice: int
    ends_at_once: bool
    ending: str  # of the transition: success, failure or error


#: What happens at the places where another thread could run, one after the other.
Script: TypeAlias = list[Request | None]
REQUESTS = st.builds(
    Request,
    node=st.sampled_from(NAMES),
    choice=st.sampled_from((0, 0, 0, 0, 1, 1, 2)),  # seldom a shutdown
    ends_at_once=st.sampled_from((True, True, False)),
    ending=st.sampled_from(("success", "success", "success", "failure", "error")),
)
SCRIPTS = st.lists(st.none() | REQUESTS, max_size=12)


class SimulatedNode:
    """The state machine of a node, and its loop."""

    name = "default"  # of the loop
    transition_started_s = 0.0
    transition_timeout_s = 10.0
    has_finished = False

    def __init__(self, model: Node, world: World, listener: SupervisionListener) -> None:
        self.model = model
        self.full_name = model.full_name
        self.is_absent = False  # an external node is awaited by its activation
        self.awaited: Future[TransitionOutcome] | None = None
        self.state = "unconfigured"
        self.loop = self.lifecycle = self
        self.breaks = False
        self._running = ""  # the requested transition that runs
        self._start = ""
        self._name = model.name.value
        self._world = world
        self._listener = listener

    @property
    def available(self) -> tuple[str, ...]:
        return TRANSITIONS.get(self.state, ())

    @property
    def is_moving(self) -> bool:
        return bool(self._running)

    def run_task(
        self, work: Coroutine[Any, Any, TransitionOutcome | None]
    ) -> Future[TransitionOutcome]:
        future: Future[TransitionOutcome] = Future()
        try:
            work.send(None)
        except StopIteration as end:
            if end.value is None:
                self.awaited = future
            else:
                future.set_result(end.value)
        return future

    def end_awaited(self, ending: str) -> None:
        """End the step in which an external node is awaited."""
        future, self.awaited = self.awaited, None
        if future is not None:
            future.set_result(self._finish(ending, requested=False))

    async def run_step(
        self, transition: str, is_outdated: Callable[[], bool]
    ) -> TransitionOutcome | None:
        """Wait for a requested transition, then run the step as the lifecycle does.

        Return None if an external node is awaited.
        """
        self._world.interleave()
        self.end("success")
        if is_outdated():
            return TransitionOutcome(transition, self.state, False, requested=False, outdated=True)
        if transition not in self.available:
            return TransitionOutcome(transition, self.state, False, "refused", requested=False)
        self._world.on_step(self._name, transition)
        self._running, self._start = transition, self.state
        if self.is_absent and transition == "activate":
            self.state = "activating"
            return None
        outcome = self._finish("error" if self.breaks else "success", requested=False)
        self.breaks = False
        self._world.interleave()
        return outcome

    def request(self, request: Request) -> None:
        """Run, begin or end a requested transition."""
        if self.awaited is not None:
            return
        if self._running:
            self.end(request.ending)
        elif self.available:
            self._running = self.available[request.choice]
            self._start, self.state = self.state, f"{self._running} runs"
            if request.ends_at_once:
                self.end(request.ending)

    def end(self, ending: str) -> None:
        """End the requested transition that runs, if any."""
        if self._running and self.awaited is None:
            self._finish(ending, requested=True)

    def _finish(self, ending: str, *, requested: bool) -> TransitionOutcome:
        transition, self._running = self._running, ""
        ends = {"success": GOALS[transition], "failure": self._start, "error": "unconfigured"}
        self.state = ends[ending]
        is_success = ending == "success"
        outcome = TransitionOutcome(transition, self.state, is_success, ending, requested=requested)
        self._world.on_end(self._name, outcome)
        self._listener.on_transition_end(outcome)
        return outcome


class NoOtherProcesses:
    """The other processes of a system that has none."""

    def requests_together(self) -> AbstractContextManager[None]:
        return nullcontext()

    def __init__(self) -> None:
        self.goals = KeptGoals(SYSTEM, None)


class World:
    """A node set of simulated nodes, and what the test knows about them."""

    process_of: Mapping[str, str] = MappingProxyType({})

    def __init__(self) -> None:
        self.nodes: dict[str, SimulatedNode] = {}
        self.other_processes = NoOtherProcesses()
        self.hung: frozenset[str] = frozenset()
        self._script: Iterator[Request | None] = iter(())
        self._clock = 0
        self.moved_at = dict.fromkeys(NAMES, 0)
        self.broken: set[str] = set()  # the last step of these nodes has failed
        #: The nodes that the supervisor may move: it had a reason since they were moved on request.
        self.may_move = set(NAMES)
        #: The states that requested transitions ended in, of the other nodes.
        self.left_in: dict[str, str] = {}

    # --- what happens

    def play(self, script: Script) -> None:
        self._script = iter(script)

    def interleave(self) -> None:
        request = next(self._script, None)
        if request is not None:
            self.nodes[request.node].request(request)

    def on_step(self, name: str, transition: str) -> None:
        assert name in self.may_move, f"'{transition}' of {name} undoes a requested transition"
        if transition == "configure" and name == "teleop":  # a class, which is constructed now
            assert self.nodes[EXTERNAL].state not in ("activating", "configuring")
        if transition == "activate":  # what follows a failure is decided before
            # Nodes that need each other only inactive are activated at the same time.
            needed = [
                edge.on
                for edge in dependency_edges(SYSTEM)
                if edge.node == name and edge.state is PrimaryState.ACTIVE
            ]
            missing = [other for other in needed if other in self.broken]
            assert not missing, f"{name} is activated without {missing}"

    def on_end(self, name: str, outcome: TransitionOutcome) -> None:
        self.broken.discard(name)
        if outcome.reason == "error" and not outcome.requested and name != "camera":
            self.broken.add(name)
        if not outcome.requested or outcome.reason == "failure":
            return
        self._clock += 1
        self.moved_at[name] = self._clock
        self.may_move.discard(name)
        self.left_in.pop(name, None)
        if outcome.state == GOALS[outcome.transition]:
            self.left_in[name] = outcome.state

    def allow(self, *names: str) -> None:
        """Allow moves of nodes and of those that depend on them."""
        for name in names:
            affected = {name, *DEPENDENTS[name]}
            self.may_move |= affected
            for other in affected:
                self.left_in.pop(other, None)

    @property
    def now(self) -> int:
        return self._clock

    # --- the node set

    def run_step(
        self, name: str, transition: str, is_outdated: Callable[[], bool], _: Sequence[str]
    ) -> Future[TransitionOutcome]:
        node = self.nodes[name]
        return node.run_task(node.run_step(transition, is_outdated))

    def states(self) -> Mapping[str, PrimaryState]:
        found = {}
        for name, node in self.nodes.items():
            self.interleave()
            if node.state in STATES:
                found[name] = STATES[node.state]
        return found

    def is_lost(self, _: str) -> bool:
        return False

    def recreate(self, name: str, is_outdated: Callable[[], bool]) -> str | None:
        self.interleave()
        node = self.nodes[name]
        if node.state == FINALIZED and not is_outdated():
            node.state = "unconfigured"
        return None


class NotedQueue(MainQueue[Item]):
    """A queue that notes when each fault was noticed."""

    def __init__(self, world: World) -> None:
        super().__init__(COMPUTER)
        self._world = world
        self.length = 0
        self.noticed: dict[int, int] = {}
        self.taken: list[Item] = []  # keeps their ids unique

    def get(self, until_s: float = 0.0) -> Item | None:
        item = super().get(until_s)
        if item is not None:
            self._on_taken([item])
        return item

    def take_next(self, kind: type[T]) -> list[T]:
        items = super().take_next(kind)
        self._on_taken(cast("list[Item]", items))
        return items

    def _on_taken(self, items: Sequence[Item]) -> None:
        self.length -= len(items)
        self.taken += items
        for item in items:
            if isinstance(item, Fault) and self.noticed[id(item)] < self._world.moved_at[item.node]:
                continue  # it is outdated
            # An ignored failure moves no node.
            if isinstance(item, Fault | StepEnded | NodeReturned) and item.node != "camera":
                self._world.allow(item.node)

    def put(self, item: Item) -> None:
        self.length += 1
        self.noticed.setdefault(id(item), self._world.now)
        super().put(item)
