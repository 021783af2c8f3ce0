"""Limits log lines that something repeats, so that no input fills the log."""

from __future__ import annotations

import threading
from collections.abc import Callable

from composer.base.fast_dataclass import dataclass
from composer.runtime.clock import Clock

_MAX_SUBJECTS = 1000
#: The subject of everything new while the limit knows too many subjects.
_OTHERS = ""


@dataclass(frozen=True, slots=True)
class Admission:
    """A line that may be logged, after ``omitted`` others about the same subject."""

    is_first: bool
    omitted: int

    @property
    def suffix(self) -> str:
        """What to append to the line."""
        return f" ({self.omitted} more since the last message)" if self.omitted else ""


@dataclass(slots=True)
class _Subject:
    admitted_s: float
    omitted: int = 0


class RepeatLimit:
    """Admits one line per subject and period, and counts the others. Thread-safe."""

    def __init__(self, clock: Clock, period_s: float = 1.0) -> None:
        self._clock = clock
        self._period_s = period_s
        # Reentrant: garbage collection may report a lost exception, at any allocation.
        self._lock = threading.RLock()
        self._subjects: dict[str, _Subject] = {}

    def warn(self, warn: Callable[[str], None], subject: str, text: str, number: int = 1) -> None:
        """Call ``warn`` with a line about ``subject`` if it may be logged now."""
        admission = self.admit(subject, number)
        if admission is not None:
            warn(f"{text}{admission.suffix}")

    def admit(self, subject: str, number: int = 1) -> Admission | None:
        """Return whether a line about ``subject`` may be logged now; None if not.

        It is about ``number`` events, and names one of them.
        """
        now_s = self._clock.monotonic()
        with self._lock:
            known = self._subjects.get(subject)
            if known is None and len(self._subjects) >= _MAX_SUBJECTS:
                subject = self._make_room(subject, now_s)
                known = self._subjects.get(subject)
            if known is not None and now_s < known.admitted_s + self._period_s:
                known.omitted += number
                return None
            self._subjects[subject] = _Subject(now_s, number - 1)
            return Admission(known is None, 0 if known is None else known.omitted)

    def _make_room(self, subject: str, now_s: float) -> str:
        """Forget subjects whose period is over; return the subject to count ``subject`` as."""
        for name, known in tuple(self._subjects.items()):
            if now_s >= known.admitted_s + self._period_s:
                del self._subjects[name]
        return subject if len(self._subjects) < _MAX_SUBJECTS else _OTHERS
