"""One life of a process of the system, from its start or its first report to its end."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from composer.base.fast_dataclass import dataclass
from composer.runtime.children.child_processes import Child
from composer.runtime.members.report import MemberReport, MemberState


@dataclass(slots=True)
class MemberLife:
    """One life of the process, as a child or started elsewhere, and its last report.

    Its reports are signed with ``report_key``. ``lost`` is why its nodes have failed, although
    it may still run. ``holds_lock`` is whether it holds the instance lock on this computer.
    ``answered`` are the numbers of the last reports before the responses to requests, by node.
    """

    report_key: str
    child: Child | None = None
    last: MemberReport | None = None
    reported_s: float = 0.0
    lost: str = ""
    holds_lock: bool = False
    answered: dict[str, int] = field(default_factory=dict)

    @property
    def states(self) -> Mapping[str, MemberState]:
        """The nodes in the last report."""
        return {} if self.last is None else self.last.nodes

    @property
    def is_up(self) -> bool:
        """Whether it reports."""
        return self.last is not None and not self.lost
