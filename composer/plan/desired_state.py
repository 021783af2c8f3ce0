"""The desired state of a system: goals, failed nodes, and restarts.

Everything that changes it has a place in one order, given by serial numbers: requested transitions
and failures increase :attr:`DesiredState.serial`. A plan, and a fault, carry the serial number of
the desired state that they are based on. If the node of a step or of a fault has been moved
on request after that, the step or the fault is outdated: the later of two changes of a node wins.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field, replace
from enum import StrEnum
from typing import TypeVar

from composer.base.fast_dataclass import dataclass
from composer.model import Node, OnFailure, PrimaryState, System

T = TypeVar("T")


class FaultKind(StrEnum):
    """How the failure of a node was detected."""

    TRANSITION = "transition"  # requested, ended in an error
    STEP = "step"  # a step of a plan failed
    SILENCE = "silence"
    CALLBACK = "callback"  # took too long and was interrupted
    ERRORS = "errors"  # too many of them
    REPORTED = "reported"  # by the node itself
    ENDED = "ended"  # a process or an external node, by itself
    FINISHED = "finished"  # a process, by itself, with exit status 0
    ABSENT = "absent"  # not there, and only something else can start it
    LOST = "lost"  # a callback does not return and cannot be interrupted


class Condition(StrEnum):
    """What becomes of a failed node, in the words that users see."""

    RESTARTING = "restarting"  # a restart is scheduled
    ISOLATED = "isolated"  # down until a command or a tool brings it up
    GIVEN_UP = "given up"  # the same, after too many restarts
    FINISHED = "finished"  # down as isolated: its program ended itself, with exit status 0
    ABSENT = "absent"  # down until something else starts it
    IGNORED = "failure ignored"  # not down: no node is moved


@dataclass(frozen=True, slots=True)
class Fault:
    """A failure of a node. ``node`` is its key; ``serial`` that of the desired state at the time.

    A fault is outdated once a requested transition has moved the node.
    """

    node: str
    kind: FaultKind
    text: str
    serial: int


@dataclass(frozen=True, slots=True)
class Restart:
    """A scheduled restart of a failed node; see :class:`.Decision` for ``attempt``."""

    node: str
    attempt: int
    due_s: float


@dataclass(frozen=True, slots=True)
class DesiredState:
    """The desired state of each node, by its key.

    ``goals`` are the states requested for the nodes, ``down`` the reasons why failed nodes are kept
    down anyway, and ``conditions`` what becomes of these. ``ignored`` are the reasons of failures
    that are ignored: nodes that depend on such a node do without it. ``scheduled`` are the restarts
    to come, ``restarts`` the times of earlier ones, oldest first, in seconds of the caller's clock.
    ``unhandled`` are the nodes with a failed transition whose fault has not been handled, with the
    serial number of the fault.

    ``serial`` is the number of the last requested transition or failure; ``moved`` and ``failed``
    are the numbers of the last requested transition of each node, and of the failure that keeps it
    down. ``activity`` is what the system is with these goals: "running", "paused" or "reset".
    """

    goals: Mapping[str, PrimaryState]
    down: Mapping[str, str] = field(default_factory=dict)
    conditions: Mapping[str, Condition] = field(default_factory=dict)
    ignored: Mapping[str, str] = field(default_factory=dict)
    restarts: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    scheduled: Mapping[str, Restart] = field(default_factory=dict)
    unhandled: Mapping[str, int] = field(default_factory=dict)
    serial: int = 0
    moved: Mapping[str, int] = field(default_factory=dict)
    failed: Mapping[str, int] = field(default_factory=dict)
    activity: str = "running"

    @property
    def next_restart(self) -> Restart | None:
        """The scheduled restart that is due first."""
        return min(self.scheduled.values(), key=lambda restart: restart.due_s, default=None)

    def has_moved(self, node: str, since: int) -> bool:
        """Return whether a requested transition has moved the node since a serial number."""
        return self.moved.get(node, 0) > since

    def failed_after_move_of(self, node: str, failed: str) -> bool:
        """Return whether ``failed`` has failed since ``node`` was last moved on request."""
        return self.failed.get(failed, 0) >= self.moved.get(node, 0)

    def with_goals(
        self,
        goals: Mapping[str, PrimaryState],
        since: int | None = None,
        activity: str = "",
    ) -> DesiredState:
        """Return a copy with new goals for some of the nodes, and perhaps another activity.

        ``since`` is the serial number at which the goals were requested: nodes that have been moved
        on request after that keep theirs.
        """
        since = self.serial if since is None else since
        new = {name: goal for name, goal in goals.items() if not self.has_moved(name, since)}
        merged = {**self.goals, **new}
        return replace(self, goals=merged, activity=activity or self.activity)

    def move(self, node: str, state: PrimaryState) -> DesiredState:
        """Return a copy after a requested transition: the new state is the goal of the node.

        It is no longer kept down.
        """
        moved = self.release(node).with_goals({node: state})
        return replace(
            moved,
            unhandled=_without(self.unhandled, node),
            serial=self.serial + 1,
            moved={**self.moved, node: self.serial + 1},
        )

    def break_down(self, node: str) -> DesiredState:
        """Return a copy after a requested transition that ended in an error: a fault follows."""
        serial = self.serial + 1
        return replace(
            self,
            unhandled={**self.unhandled, node: serial},
            serial=serial,
            moved={**self.moved, node: serial},
        )

    def await_fault(self, fault: Fault) -> DesiredState:
        """Return a copy in which no plan moves the node of ``fault`` until it is handled."""
        return replace(self, unhandled={**self.unhandled, fault.node: fault.serial})

    def ignore(self, fault: Fault) -> DesiredState:
        """Return a copy in which ``fault`` has been handled; a later one of the node may remain."""
        if self.unhandled.get(fault.node, 0) > fault.serial:
            return self
        return replace(self, unhandled=_without(self.unhandled, fault.node))

    def fail(self, fault: Fault, condition: Condition = Condition.ISOLATED) -> DesiredState:
        """Return a copy that keeps the node of ``fault`` down, unless the fault is outdated."""
        node = fault.node
        handled = self.ignore(fault)
        if self.is_outdated(fault):
            return handled
        return replace(
            handled,
            down={**self.down, node: fault.text},
            conditions={**self.conditions, node: condition},
            ignored=_without(self.ignored, node),
            serial=self.serial + 1,
            failed={**self.failed, node: self.serial + 1},
        )

    def tolerate(self, fault: Fault) -> DesiredState:
        """Return a copy in which no other node minds the failure, unless the fault is outdated."""
        handled = self.ignore(fault)
        if self.is_outdated(fault):
            return handled
        return replace(handled, ignored={**self.ignored, fault.node: fault.text})

    def is_outdated(self, fault: Fault) -> bool:
        """Return whether a requested transition has moved the node since the fault.

        A node that cannot be interrupted does not get better by that.
        """
        return fault.kind is not FaultKind.LOST and self.has_moved(fault.node, fault.serial)

    def schedule(self, restart: Restart) -> DesiredState:
        """Return a copy with a restart of a node, if the node is kept down."""
        if restart.node not in self.down:
            return self
        return replace(self, scheduled={**self.scheduled, restart.node: restart})

    def restart(self, node: str, at_s: float) -> DesiredState:
        """Return a copy that releases the node and counts one more restart."""
        restarts = {**self.restarts, node: (*self.restarts.get(node, ()), at_s)}
        return replace(self.release(node), restarts=restarts)

    def release(self, node: str) -> DesiredState:
        """Return a copy that no longer keeps the node down, without a restart to come."""
        return replace(
            self,
            down=_without(self.down, node),
            conditions=_without(self.conditions, node),
            ignored=_without(self.ignored, node),
            scheduled=_without(self.scheduled, node),
        )

    def forget_failures(self, nodes: Iterable[str] | None = None) -> DesiredState:
        """Return a copy without the failures and restarts of nodes, by default of all."""
        forgotten = self
        for node in {*self.down, *self.ignored, *self.restarts} if nodes is None else nodes:
            released = forgotten.release(node)
            forgotten = replace(released, restarts=_without(released.restarts, node))
        return forgotten


def _without(items: Mapping[str, T], name: str) -> Mapping[str, T]:
    return {key: item for key, item in items.items() if key != name}


_CONDITIONS = {
    OnFailure.RESTART: Condition.RESTARTING,
    OnFailure.ISOLATE: Condition.ISOLATED,
    OnFailure.SHUTDOWN: Condition.ISOLATED,
    OnFailure.IGNORE: Condition.IGNORED,
}


@dataclass(frozen=True, slots=True)
class Decision:
    """How to handle a fault.

    For ``restart``, the node is taken down now and brought up after ``wait_s``, as attempt number
    ``attempt`` within the window of its restart policy. ``is_given_up``: it had its restarts.
    ``is_finished``: its program has ended itself with exit status 0. The run has not failed then.
    """

    action: OnFailure
    reason: str
    wait_s: float = 0.0
    attempt: int = 0
    is_absent: bool = False
    is_finished: bool = False
    is_given_up: bool = False

    @property
    def condition(self) -> Condition:
        """What becomes of the node."""
        if self.is_absent and self.action is OnFailure.ISOLATE:
            return Condition.ABSENT
        if self.is_finished and self.action in (OnFailure.ISOLATE, OnFailure.SHUTDOWN):
            return Condition.FINISHED
        return Condition.GIVEN_UP if self.is_given_up else _CONDITIONS[self.action]

    @property
    def consequence(self) -> str:
        """What follows, in words."""
        if self.action is OnFailure.SHUTDOWN:
            return "shutting down the system"
        match self.condition:
            case Condition.RESTARTING:
                return f"restart {self.attempt} in {self.wait_s:g} s"
            case Condition.ABSENT:
                return "waiting for it"
            case Condition.GIVEN_UP:
                return "giving it up"
            case Condition.IGNORED:
                return "ignoring it"
            case _:
                return "isolating it"


def decide(system: System, desired: DesiredState, fault: Fault, now_s: float) -> Decision | None:
    """Return how to handle ``fault``; None if there is nothing to do.

    That is so if the node is unknown or already kept down, or if this failure is ignored already.
    An absent node cannot be restarted, and is isolated until it returns. A node that hangs can
    neither be restarted nor ignored. A node that is not required never ends the system.
    """
    node = system.node(fault.node)
    if node is None or fault.node in desired.down or desired.ignored.get(fault.node) == fault.text:
        return None
    decision = _by_policy(node, desired, fault, now_s)
    if decision.action is OnFailure.SHUTDOWN and not node.required:
        decision = replace(decision, action=OnFailure.ISOLATE)
    is_finished = fault.kind is FaultKind.FINISHED and not decision.is_given_up
    return replace(decision, is_absent=fault.kind is FaultKind.ABSENT, is_finished=is_finished)


def _by_policy(node: Node, desired: DesiredState, fault: Fault, now_s: float) -> Decision:
    policy, restart = node.supervision.policy, node.supervision.restart
    if policy is OnFailure.IGNORE and fault.kind is FaultKind.LOST:
        return Decision(OnFailure.ISOLATE, fault.text)
    if policy is not OnFailure.RESTART:
        return Decision(policy, fault.text)
    if fault.kind is FaultKind.ABSENT:
        return Decision(OnFailure.ISOLATE, fault.text)
    if fault.kind is FaultKind.LOST:
        reason = f"{fault.text}; it cannot be restarted"
        return Decision(restart.then, reason, is_given_up=True)
    since_s = now_s - restart.window_ms / 1000.0
    attempts = sum(at_s > since_s for at_s in desired.restarts.get(fault.node, ()))
    if attempts >= restart.max_attempts:
        times = "once" if attempts == 1 else f"{attempts} times"
        reason = f"{fault.text}; restarted {times} within {restart.window_ms / 1000.0:g} s before"
        return Decision(restart.then, reason, is_given_up=True)
    return Decision(OnFailure.RESTART, fault.text, restart.backoff_s(attempts), attempts + 1)
