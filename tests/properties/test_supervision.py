"""Requested transitions, faults and plans in any order: a failure stays where it is.

The supervisor, the plan executor and the listeners are the real ones.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from composer.model import PrimaryState
from composer.model.dependencies import dependency_edges
from composer.plan import Condition, DesiredState, Fault, FaultKind, reconcile
from composer.runtime.clock import COMPUTER
from composer.runtime.supervision.commands import Commands
from composer.runtime.supervision.events import Reporter
from composer.runtime.supervision.main_queue import (
    Command,
    NodeEvent,
    SupervisionContext,
    SupervisionListener,
)
from composer.runtime.supervision.reconciler import Reconciler
from composer.runtime.supervision.status import Status
from composer.runtime.supervision.supervisor import Supervisor
from tests.examples import examples

if TYPE_CHECKING:
    from composer.runtime.supervision.node_set import NodeSet

from tests.properties.simulated_nodes import (
    EXTERNAL,
    NAMES,
    REQUESTS,
    SCRIPTS,
    SYSTEM,
    NotedQueue,
    Request,
    Script,
    SimulatedNode,
    World,
)


class Supervision(RuleBasedStateMachine):
    """Requests, faults, commands and what the supervisor does about them, in any order."""

    def __init__(self) -> None:
        super().__init__()
        self.system = SYSTEM
        self.world = World()
        self.queue = NotedQueue(self.world)
        context = SupervisionContext(
            self.system,
            cast("NodeSet", self.world),
            self.queue,
            Status(self.system, COMPUTER),
            Reporter(None, COMPUTER),
        )
        self.supervisor = Supervisor(Reconciler(context))
        self.commands = Commands(context, self.supervisor)
        listener_of: dict[str, SupervisionListener] = {}
        for model in self.system.nodes:
            listener = SupervisionListener(model, context)
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
            self.listener.on_ended("it has disappeared", is_awaited=True)

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


TestSupervision = Supervision.TestCase
TestSupervision.settings = examples(100)
