"""Pairs of reports of each system, some time apart, from which rates follow."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from composer.base.fast_dataclass import dataclass

if TYPE_CHECKING:
    from composer.client.systems.system_reports import SystemReport

#: Managers report every second, and at each change: those are too close for a rate.
_APART_S = 0.5


@dataclass(frozen=True, slots=True)
class ReportPair:
    """Two reports of a system, ``passed_s`` apart; ``before`` is None for the first one."""

    before: SystemReport | None
    now: SystemReport
    passed_s: float


class ReportPairs:
    """The last two reports of each system that are far enough apart."""

    def __init__(self, at_s: Callable[[SystemReport], float]) -> None:
        """``at_s`` returns the time of a report in seconds; 0 if it has none, as the first one."""
        self._at_s = at_s
        self._pairs: dict[str, ReportPair] = {}

    def update(self, reports: Mapping[str, SystemReport | None]) -> dict[str, ReportPair]:
        """Add the current reports; return the pair of each system that has reported."""
        pairs: dict[str, ReportPair] = {}
        for name, report in reports.items():
            if report is None:
                continue
            known = self._pairs.get(name)
            if known is None or known.now.pid != report.pid or not self._at_s(known.now):
                pairs[name] = ReportPair(None, report, 0.0)
                continue
            passed_s = self._at_s(report) - self._at_s(known.now)
            is_new = passed_s >= _APART_S or passed_s < 0.0
            pairs[name] = ReportPair(known.now, report, max(0.0, passed_s)) if is_new else known
        self._pairs = pairs
        return pairs
