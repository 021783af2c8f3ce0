"""A robot, the states of its nodes and their faults, for the tests of plans."""

from __future__ import annotations

from collections.abc import Sequence

from composer.model import PrimaryState, System
from composer.plan import Fault, FaultKind, Plan
from tests.unit.support.resolving import system_of

ACTIVE, INACTIVE, UNCONFIGURED = (
    PrimaryState.ACTIVE,
    PrimaryState.INACTIVE,
    PrimaryState.UNCONFIGURED,
)
LETTERS = {"u": UNCONFIGURED, "i": INACTIVE, "a": ACTIVE}
NAMES = ("sensor", "planner", "motor", "logger", "camera")


def robot(
    lifecycle: str = "{on_failure: restart}", sensor: str = "{}", camera: str = "{}"
) -> System:
    return system_of(
        f"""
        system: robot
        lifecycle: {lifecycle}
        nodes:
          logger: {{lifecycle: {{depends_on: {{planner: inactive}}}}}}
          motor: {{lifecycle: {{depends_on: [planner]}}}}
          planner: {{lifecycle: {{depends_on: [sensor]}}}}
          sensor: {sensor}
          camera: {camera}
        """
    )


def states(letters: str, names: Sequence[str] = NAMES) -> dict[str, PrimaryState]:
    """Return the states of nodes by their first letters; a node with ``-`` is left out."""
    pairs = zip(names, letters, strict=True)
    return {name: LETTERS[letter] for name, letter in pairs if letter != "-"}


def fault(node: str, kind: FaultKind = FaultKind.SILENCE, serial: int = 0) -> Fault:
    return Fault(node, kind, "silent for 300 ms", serial)


def steps(plan: Plan) -> list[str]:
    return [f"{step.transition} {step.node}" for step in plan.steps]
