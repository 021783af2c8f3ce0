"""The reports of running systems."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from composer.client.session import Deadline
from composer.client.systems.local_queries import local_report
from composer.client.systems.managers import Systems
from composer.runtime.process.instance_lock import local_systems
from composer.runtime.protocol.reports import SystemReport

if TYPE_CHECKING:
    from composer.client.shared_session import SharedSession

_SYSTEMS_PERIOD_S = 3.0
#: Managers report every second.
_SILENT_S = 5.0
_FIRST_WITHIN_S = 1.0


class SystemReports:
    """The reports of running systems, while anything uses them."""

    def __init__(self, session: SharedSession, on_report: Callable[[], None]) -> None:
        self._session = session
        self._on_report = on_report
        self._systems: Systems | None = None
        self._discovered: tuple[str, ...] = ()
        self._change = -1
        self._users = 0
        self._callback_users = 0
        self._with_callbacks = False
        self._due_s = 0.0
        #: The last report of each system, and when it was seen first.
        self._seen: dict[str, tuple[SystemReport | None, float]] = {}

    @contextmanager
    def used(self, *, callbacks: bool = False) -> Iterator[None]:
        """Subscribe to the reports in a ``with`` block, with timings of callbacks on request."""
        self._users += 1
        self._callback_users += callbacks
        try:
            yield
        finally:
            self._users -= 1
            self._callback_users -= callbacks
            if not self._users:
                self.close()

    def current(self) -> dict[str, SystemReport | None]:
        """Return the last report of each system, None for systems that do not report."""
        if not self._users:
            return {}
        with_callbacks = self._callback_users > 0
        if self._systems is None or with_callbacks is not self._with_callbacks:
            self.close()
            self._with_callbacks, self._due_s = with_callbacks, 0.0
            self._systems = Systems(
                self._session,
                Deadline(math.inf),
                callbacks=with_callbacks,
                on_report=self._on_report,
            )
        systems = self._systems
        now_s = time.monotonic()
        if now_s >= self._due_s:
            self._due_s = now_s + _SYSTEMS_PERIOD_S
            local = local_systems()
            change = self._session.changes.number()
            if change != self._change:
                self._change, self._discovered = change, systems.discover()
            known = {*self._discovered, *local}
            systems.subscribe(known)
            self._ask(local)
            systems.forget([name for name in systems.current() if name not in known])
        return {name: self._fresh(name, report) for name, report in systems.current().items()}

    def _ask(self, local: Iterable[str]) -> None:
        """Ask systems on this computer for their first report: a topic takes a second."""
        for name in local:
            if name not in self._seen:
                report = local_report(name, _FIRST_WITHIN_S, callbacks=self._with_callbacks)
                self._seen[name] = (report, time.monotonic())

    def _fresh(self, name: str, report: SystemReport | None) -> SystemReport | None:
        """Return the last report of a system, None if that is too old."""
        now_s = time.monotonic()
        last, seen_s = self._seen.get(name, (None, now_s))
        if report is not None and report is not last:
            self._seen[name] = (report, now_s)
            return report
        return last if now_s < seen_s + _SILENT_S else None

    def close(self) -> None:
        """Unsubscribe."""
        if self._systems is not None:
            self._systems.close()
            self._systems = None
