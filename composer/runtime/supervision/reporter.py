"""Tells whoever started the host what happens, one event at a time, from any thread."""

from __future__ import annotations

import threading
import time

from composer.runtime.supervision.events import Event, Report


class Reporter:
    """Hands events to a listener until that fails: the system is more than its spectators."""

    def __init__(self, listener: Report | None) -> None:
        self._listener = listener
        self._lock = threading.Lock()
        self._started_at_s = time.monotonic()

    @property
    def elapsed_s(self) -> float:
        """The seconds since the start, for events."""
        return time.monotonic() - self._started_at_s

    def tell(self, event: Event) -> None:
        """Tell of an event."""
        with self._lock:
            if self._listener is None:
                return
            try:
                self._listener(event)
            except Exception:  # nobody reads any more
                self._listener = None
