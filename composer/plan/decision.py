"""Decide how to handle a failed node, by its policy."""

from __future__ import annotations

from dataclasses import replace

from composer.base.fast_dataclass import dataclass
from composer.model import Node, OnFailure, System
from composer.plan.desired_state import Condition, DesiredState, Fault, FaultKind

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
    """

    action: OnFailure
    reason: str
    wait_s: float = 0.0
    attempt: int = 0
    is_absent: bool = False
    is_given_up: bool = False

    @property
    def condition(self) -> Condition:
        """What becomes of the node."""
        if self.is_absent and self.action is OnFailure.ISOLATE:
            return Condition.ABSENT
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
    return replace(decision, is_absent=fault.kind is FaultKind.ABSENT)


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
