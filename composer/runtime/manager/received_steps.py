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

from composer.runtime.members.figures import REPORTS_WITHIN_S
from composer.runtime.protocol.requests import Step

T = TypeVar("T")

#: The coordinating process gives up a process whose reports are missing, after this time at most.
_OUTDATED_S = REPORTS_WITHIN_S + 1.0


class ReceivedSteps(Generic[T]):
    """The last step of each node, with its sender and what runs it."""

    def __init__(self) -> None:
        self._last: dict[str, tuple[str, int, T]] = {}
        #: The sender and the number of the last step that was received, as they are reported.
        self.last = ("", 0)

    def find(self, sender: str, step: Step) -> T | None:
        """Return what runs a step that was received before; None if it is a new one."""
        last = self._last.get(step.node)
        return last[2] if last is not None and last[:2] == (sender, step.number) else None

    def is_replaced(self, sender: str, step: Step) -> bool:
        """Return whether a later step of the node was received before, from the same sender."""
        last_sender, last_number, _ = self._last.get(step.node, ("", 0, None))
        return sender == last_sender and step.number < last_number

    def add(self, sender: str, step: Step, running: T) -> None:
        """Keep what runs a new step."""
        self._last[step.node] = sender, step.number, running
        self.last = sender, step.number

    def of(self, nodes: Iterable[str]) -> list[T]:
        """Return what runs, or ran, the last steps of some nodes."""
        return [self._last[node][2] for node in nodes if node in self._last]


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
