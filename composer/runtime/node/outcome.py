"""How the transitions of a node end."""

from __future__ import annotations

from composer.fast_dataclass import dataclass

#: The label of the state that a node cannot leave.
FINALIZED = "finalized"
#: The labels of the states between transitions.
PRIMARY_STATES = ("unconfigured", "inactive", "active", FINALIZED)


@dataclass(frozen=True, slots=True)
class TransitionOutcome:
    """How a requested transition ended, in which state, and why it did not succeed.

    ``external`` is false for the step of a plan; ``outdated`` is true for a step that was not run
    because an external transition came first.
    """

    transition: str
    state: str
    success: bool
    reason: str = ""
    external: bool = True
    outdated: bool = False
