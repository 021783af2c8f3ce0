"""Requested transitions, faults and plans in any order: a failure stays where it is.

The supervisor, the plan executor and the listeners are the real ones. The nodes are simulated,
without ROS and threads: wherever another thread could run, some requests come first.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar, cast

from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from composer.model import Node, PrimaryState
from composer.model.dependencies import dependency_edges
from composer.model.lifecycle import FINALIZED
from composer.plan import Condition, DesiredState, Fault, FaultKind, reconcile
from composer.runtime.clock.clock import COMPUTER
from composer.runtime.executors.futures import Future
from composer.runtime.node.managed_node import TransitionOutcome
from composer.runtime.supervision.commands import Commands
from composer.runtime.supervision.events import Reporter
from composer.runtime.supervision.main_queue import (
    Command,
    Item,
    MainQueue,
    NodeEvent,
    NodeReturned,
    StepEnded,
)
from composer.runtime.supervision.node_listener import SupervisionListener
from composer.runtime.supervision.reconciler import Reconciler
from composer.runtime.supervision.status import Status
from composer.runtime.supervision.supervisor import Supervisor
from tests.examples import examples
from tests.unit.support.resolving import system_of

if TYPE_CHECKING:
    from composer.runtime.supervision.node_set import NodeSet

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

    def keep_goals(self, goals: Mapping[str, PrimaryState], activity: str) -> None:
        pass


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

    def is_absent(self, name: str) -> bool:
        return self.nodes[name].is_absent

    def has_finished(self, _: str) -> bool:
        return False

    def timeout_s(self, _: str) -> float:
        return 10.0

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


class Supervision(RuleBasedStateMachine):
    """Requests, faults, commands and what the supervisor does about them, in any order."""

    def __init__(self) -> None:
        super().__init__()
        self.system = SYSTEM
        self.world = World()
        self.queue = NotedQueue(self.world)
        reporter = Reporter(None, COMPUTER)
        status = Status(self.system, COMPUTER)
        node_set = cast("NodeSet", self.world)
        self.supervisor = Supervisor(
            Reconciler(self.system, node_set, self.queue, status, reporter)
        )
        self.commands = Commands(self.system, node_set, self.supervisor, status)
        listener_of: dict[str, SupervisionListener] = {}
        for model in self.system.nodes:
            listener = SupervisionListener(
                model, self.supervisor.reconciler.shared, self.queue, status, reporter
            )
            listener_of[model.name.value] = listener
            self.world.nodes[model.name.value] = SimulatedNode(model, self.world, listener)
        self.listener = listener_of[EXTERNAL]
        self.external = self.world.nodes[EXTERNAL]
        self.is_reconciled = True

    @initialize(failing=st.sets(st.sampled_from(NAMES)), is_absent=st.booleans())
    def start(self, failing: set[str], is_absent: bool) -> None:
        """Bring the system up; some nodes fail, and the external one may not be there."""
        for name in failing:
            self.world.nodes[name].breaks = True
        self.external.is_absent = is_absent
        goals = dict.fromkeys(NAMES, PrimaryState.ACTIVE)
        assert self.supervisor.bring_up(goals, lambda _: None, 0, 10.0) is None
        self.world.may_move -= set(self.active)

    @property
    def active(self) -> list[str]:
        return [name for name, node in self.world.nodes.items() if node.state == "active"]

    def handle(self) -> None:
        event = cast("NodeEvent", self.queue.get())
        self.is_reconciled = True
        self.supervisor.handle(event)

    @rule(request=REQUESTS)
    def request_a_transition(self, request: Request) -> None:
        self.world.nodes[request.node].request(request)

    @precondition(lambda self: self.active)
    @rule(index=st.integers(0, 11), request=st.none() | REQUESTS)
    def detect_silence(self, index: int, request: Request | None) -> None:
        """The health monitor reports a fault; a request may come first."""
        name = self.active[index % len(self.active)]
        serial = self.supervisor.desired.serial
        fault = Fault(name, FaultKind.SILENCE, "silent", serial)
        self.queue.noticed[id(fault)] = self.world.now
        if request is not None:
            self.world.nodes[request.node].request(request)
        self.queue.put(fault)

    @rule(name=st.sampled_from(NAMES))
    def break_the_next_step(self, name: str) -> None:
        self.world.nodes[name].breaks = True

    @precondition(lambda self: self.queue.length)
    @rule(script=SCRIPTS)
    def handle_an_event(self, script: Script) -> None:
        self.world.play(script)
        self.handle()

    @rule()
    def handle_all_events(self) -> None:
        self.world.play([])
        while self.queue.length:
            self.handle()

    @precondition(lambda self: self.supervisor.desired.scheduled)
    @rule(script=SCRIPTS)
    def restart_a_node(self, script: Script) -> None:
        """The first one by name, because the times when they are due depend on the machine."""
        _, restart = min(self.supervisor.desired.scheduled.items())
        self.world.allow(restart.node)
        self.world.play(script)
        self.supervisor.restart([restart])

    @precondition(lambda self: not self.external.is_absent and not self.external.is_moving)
    @rule()
    def the_external_node_disappears(self) -> None:
        self.external.is_absent = True
        if self.external.state in ("inactive", "active"):
            self.external.state = "unconfigured"
            self.world.allow(EXTERNAL)
            self.listener.on_ended("it has disappeared", "unconfigured", is_awaited=True)

    @precondition(lambda self: self.external.is_absent)
    @rule(is_late=st.booleans())
    def the_external_node_appears(self, is_late: bool) -> None:
        """It appears while it is awaited, or after that has failed."""
        if is_late:
            self.external.end_awaited("failure")
        self.external.is_absent = False
        self.external.end_awaited("success")
        self.listener.on_returned()

    @rule(name=st.sampled_from(("startup", "startup", "pause", "resume", "reset")), script=SCRIPTS)
    def command(self, name: str, script: Script) -> None:
        self.world.allow(*NAMES)
        self.world.play(script)
        self.is_reconciled, _ = self.commands.run(Command(name, lambda *_: None))

    @invariant()
    def requested_transitions_last(self) -> None:
        """A node is where a requested transition left it, unless there was a reason since."""
        for name, state in self.world.left_in.items():
            node = self.world.nodes[name]
            assert node.is_moving or node.state == state, name

    @invariant()
    def nothing_is_left_to_do(self) -> None:
        """Once all events are handled, every node is in its desired state."""
        if not self.queue.length and self.is_reconciled:
            desired = self.supervisor.desired
            assert not desired.unhandled
            assert desired.scheduled.keys() <= desired.down.keys()
            self.world.play([])
            plan = reconcile(self.system, desired, self.world.states(), "")
            left = [step for step in plan.steps if not self.world.nodes[step.node].is_moving]
            assert not [step for step in left if step.node not in absent(desired)]

    @invariant()
    def a_failure_stays_where_it_is(self) -> None:
        """Only nodes that fail, and those that depend on them, are not where they should be."""
        if self.queue.length or not self.is_reconciled:
            return
        desired, nodes = self.supervisor.desired, self.world.nodes
        failed = {*desired.down, *desired.ignored}
        for edge in dependency_edges(self.system):
            if edge.on in desired.down and desired.failed_after_move_of(edge.node, edge.on):
                assert nodes[edge.node].state != "active", f"{edge.node} without {edge.on}"
        for name, goal in desired.goals.items():
            if goal is not PrimaryState.ACTIVE or nodes[name].state == "active":
                continue
            edges = [edge for edge in dependency_edges(self.system) if edge.node == name]
            missing = [edge.on for edge in edges if edge.on not in desired.ignored]
            missing = [on for on in missing if nodes[on].state != "active"]
            is_moving = any(nodes[other].is_moving for other in (name, *missing))
            assert name in failed or missing or is_moving, f"{name} is {nodes[name].state}"

    @invariant()
    def each_failure_is_handled_by_its_policy(self) -> None:
        desired = self.supervisor.desired
        assert self.queue.stop_reason is None, "no node may end the system"
        assert desired.ignored.keys() <= {"camera"}
        assert "camera" not in desired.down
        for name, condition in desired.conditions.items():
            expected = {
                "arm": {Condition.RESTARTING, Condition.GIVEN_UP},
                "planner": {Condition.ISOLATED},
                "viewer": {Condition.ISOLATED},
                EXTERNAL: {Condition.ISOLATED, Condition.ABSENT},
            }
            assert condition in expected.get(name, {Condition.RESTARTING})
            assert (condition is Condition.RESTARTING) == (name in desired.scheduled)
            if condition is Condition.GIVEN_UP:
                assert len(desired.restarts[name]) >= 2


def absent(desired: DesiredState) -> list[str]:
    """Return the nodes that are left as they are until they return."""
    return [name for name, item in desired.conditions.items() if item is Condition.ABSENT]


SYSTEM = system_of(ROBOT)
TestSupervision = Supervision.TestCase
TestSupervision.settings = examples(100)
