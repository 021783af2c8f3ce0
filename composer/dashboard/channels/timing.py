"""``timing``: callbacks and chains of running systems, as ``compose top`` shows them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from composer.dashboard.declared import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.observing.reports import ReportPair, ReportPairs
from composer.dashboard.protocol.messages import Values, to_json
from composer.dashboard.protocol.outbox import Update

if TYPE_CHECKING:
    from composer.runtime.metrics.figures import CallbackRates

_MS = 1e3


class TimingFeed(Feed):
    """Timings once a second."""

    def __init__(self, _: Values, declared: Declared | None) -> None:
        self._declared = declared
        self._pairs = ReportPairs(lambda report: report.callbacks_at_s)

    def start(self) -> None:
        """Subscribe to the timings."""
        self.resources.enter_context(self.ros.reports.used(callbacks=True))

    def poll(self) -> Iterator[Update]:
        """Yield the timings of all systems."""
        reports = self.ros.reports.current()
        with_timings = {
            name: report for name, report in reports.items() if report and report.callbacks_at_s
        }
        pairs = self._pairs.update(with_timings)
        yield Update(to_json({"systems": [self._system(pair) for pair in pairs.values()]}))

    def _system(self, pair: ReportPair) -> dict[str, Any]:
        from composer.runtime.metrics.figures import rates

        before = () if pair.before is None else pair.before.callbacks
        found = rates(before, pair.now.callbacks, pair.passed_s)
        return {
            "name": pair.now.name,
            "time": pair.now.callbacks_at_s,
            "chains": [asdict(chain) for chain in pair.now.chains],
            "callbacks": [
                self._callback(item, has_rates=pair.before is not None) for item in found
            ],
        }

    def _callback(self, item: CallbackRates, *, has_rates: bool) -> dict[str, Any]:
        from composer.runtime.metrics.statistics import parse_buckets

        return {
            **asdict(item.figures),
            "calls_hz": item.calls_hz if has_rates else None,
            "busy": item.busy if has_rates else None,
            "budget_ms": self._budget_ms(item.figures.node, item.figures.name),
            "histogram": [
                [round(bound_s * _MS, 7), count]
                for bound_s, count in parse_buckets(item.figures.histogram)
            ],
        }

    def _budget_ms(self, node: str, name: str) -> float | None:
        """Return the declared time limit of a callback."""
        found = None if self._declared is None else self._declared.nodes.get(node)
        if found is None:
            return None
        budgets = {timer.name.value: timer.budget_ms for timer in found.timers}
        budgets |= {port.name.value: port.budget_ms for port in found.ports}
        budget = budgets.get(name)
        return None if budget is None else budget.value
