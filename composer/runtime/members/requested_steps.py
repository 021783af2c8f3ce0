"""Steps that are requested of another process, and when a request for them is sent again.

DDS repeats lost packets, but a request or its response may be lost nevertheless: rmw drops a
response to a client that the service has not discovered yet, and a full queue the oldest request.
So a step without a result is requested again. The process recognizes it by its number, and never
runs it twice: see :mod:`composer.runtime.manager.member_service`.

The module is apart from what needs ROS, so that it is tested without.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field

from composer.base.fast_dataclass import dataclass
from composer.plan import SystemGoals
from composer.runtime.executors.futures import Future
from composer.runtime.protocol.requests import Step, StepResult

#: A process reports each second, and each report says what it has received.
AGAIN_AFTER_S = 3.0
_REPORTS_UNTIL_LOST = 2


@dataclass(frozen=True, slots=True)
class RequestedStep:
    """A step, and the future of its result."""

    step: Step
    result: Future[StepResult] = field(default_factory=Future)


@dataclass(frozen=True, slots=True)
class MemberRequest:
    """A request on its way: steps, or goals of the system and whether it asks for timings.

    Steps are requested again ``again_after_s`` later, twice as long after each time. ``seen`` is
    the number of the last report that had been received when it was sent.
    """

    steps: Sequence[RequestedStep] = ()
    goals: SystemGoals | None = None
    timings: bool = False
    again_after_s: float = AGAIN_AFTER_S
    seen: int = 0

    @property
    def is_awaited(self) -> bool:
        """Whether a result of a step is still waited for."""
        return any(not step.result.done() for step in self.steps)

    def again(self, seen: int) -> MemberRequest:
        """Return the request for the steps that still have no result."""
        left = tuple(step for step in self.steps if not step.result.done())
        return MemberRequest(left, again_after_s=2.0 * self.again_after_s, seen=seen)

    def is_lost(self, received: int, seen: int) -> bool:
        """Return whether it has certainly not arrived.

        ``received`` is the number of the last step that the process has received according to its
        report ``seen``; the first report after the request may be older than its arrival.
        """
        is_unknown = any(
            item.step.number > received for item in self.steps if not item.result.done()
        )
        return is_unknown and seen >= self.seen + _REPORTS_UNTIL_LOST
