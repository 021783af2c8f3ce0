"""What a test reports when it fails: the expectation, and the last events of the system."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

from composer.base.fast_dataclass import dataclass

#: The events that a failure shows, and those that are kept.
SHOWN = 20
_KEPT = 1000


class TestFailure(AssertionError):
    """A system or a behavior did not do what a test expects."""

    __test__ = False  # no class of tests

    def __init__(self, text: str, timeline: list[str] | None = None) -> None:
        last = "".join(f"\n  {line}" for line in (timeline or [])[-SHOWN:])
        super().__init__(f"{text}\nthe last events:{last}" if last else text)
        #: What was expected, and what happened instead.
        self.text = text


@dataclass(frozen=True, slots=True)
class _Entry:
    time_s: float
    text: Callable[[], str]


class Timeline:
    """The last events of a test, as text. Texts are made when they are needed."""

    def __init__(self) -> None:
        self._entries: deque[_Entry] = deque(maxlen=_KEPT)

    def add(self, time_s: float, text: Callable[[], str]) -> None:
        """Add an event."""
        self._entries.append(_Entry(time_s, text))

    def lines(self, count: int = SHOWN) -> list[str]:
        """Return the last events, the oldest first, each with its time in seconds."""
        entries = sorted(self._entries, key=lambda entry: entry.time_s)[-count:]
        return [f"{entry.time_s:9.3f}  {entry.text()}" for entry in entries]


_LENGTH = 120


def short(value: Any) -> str:
    """Return a message as one line, shortened."""
    text = str(value)
    return text if len(text) <= _LENGTH else f"{text[: _LENGTH - 3]}..."
