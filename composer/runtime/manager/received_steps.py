"""Which steps a process has received from the coordinating one: no step is run twice, or too late.

A request that may be lost is sent again, so that its steps may arrive twice. And DDS repeats what
was lost for longer than the coordinating process waits: after the network has failed for a while,
steps arrive that it has given up, and nothing may be done for them any more. The clocks of two
computers may differ, so the age of a request is that of the last report that its sender had seen.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import Generic, TypeVar

from composer.base.fast_dataclass import dataclass
from composer.runtime.members.report import REPORTS_WITHIN_S

T = TypeVar("T")

#: The coordinating process gives up a process whose reports are missing, after this time at most.
_OUTDATED_S = REPORTS_WITHIN_S + 1.0


@dataclass(frozen=True, slots=True)
class StepId:
    """What identifies a step: its sender, and its number there."""

    sender: str
    number: int


class ReceivedSteps(Generic[T]):
    """The last step of each node, with what runs it."""

    def __init__(self) -> None:
        self._last: dict[str, tuple[StepId | None, T]] = {}
        #: The last step that was received, as it is reported.
        self.last_text = ""

    def find(self, node: str, step: StepId | None) -> T | None:
        """Return what runs a step that was received before; None if it is a new one."""
        last = self._last.get(node)
        return last[1] if last is not None and step is not None and last[0] == step else None

    def is_replaced(self, node: str, step: StepId | None) -> bool:
        """Return whether a later step of the node was received before, from the same sender."""
        last = None if node not in self._last else self._last[node][0]
        if step is None or last is None or step.sender != last.sender:
            return False
        return step.number < last.number

    def add(self, node: str, step: StepId | None, running: T) -> None:
        """Keep what runs a new step."""
        self._last[node] = step, running
        if step is not None:
            self.last_text = f"{step.sender} {step.number}"

    def of(self, nodes: Iterable[str]) -> list[T]:
        """Return what runs, or ran, the last steps of some nodes."""
        return [self._last[node][1] for node in nodes if node in self._last]


class ReportTimes:
    """When the last reports of this process were published."""

    def __init__(self) -> None:
        self._times: deque[tuple[int, float]] = deque()

    def note(self, number: int, now_s: float) -> None:
        """Note that a report is the current one now: it is published, or none has to follow yet."""
        if self._times and self._times[-1][0] == number:
            self._times.pop()
        self._times.append((number, now_s))
        while self._times[0][1] < now_s - _OUTDATED_S and len(self._times) > 1:
            self._times.popleft()

    def is_outdated(self, number: int, now_s: float) -> bool:
        """Return whether the sender of a request had last seen a report that is too old."""
        limit_s = now_s - _OUTDATED_S
        return not any(known == number and at_s >= limit_s for known, at_s in self._times)
