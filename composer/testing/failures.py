"""What a test reports when it fails: the expectation, and the last events of the system."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from math import inf
from typing import Any

from composer.base.diagnostics import suggestion
from composer.base.fast_dataclass import dataclass
from composer.model.ports import LogLevel

#: The events that a failure shows, and the messages of one topic among them.
SHOWN = 20
_OF_TOPIC = 3
_LENGTH = 120


class TestFailure(AssertionError):
    """A system or a behavior did not do what a test expects."""

    __test__ = False  # no class of tests

    def __init__(self, text: str, timeline: list[str] | None = None) -> None:
        #: The last events, if they are known.
        self.timeline = timeline or []
        last = "".join(f"\n  {line}" for line in self.timeline[-SHOWN:])
        super().__init__(f"{text}\nthe last events:{last}" if last else text)
        #: What was expected, and what happened instead.
        self.text = text


@dataclass(frozen=True, slots=True)
class Received:
    """A message of a topic, or a request; ``time_s`` are the seconds since the start of the run."""

    time_s: float
    message: Any
    topic: str = ""


@dataclass(frozen=True, slots=True)
class LogLine:
    """A line of the log; ``node`` is the full name of a node, or empty for the system itself."""

    time_s: float
    level: LogLevel
    node: str
    text: str


@dataclass(frozen=True, slots=True)
class _Entry:
    time_s: float
    text: Callable[[], str]
    topic: str


class Timeline:
    """The events of a test, as text. Texts are made when they are needed."""

    def __init__(self) -> None:
        self._entries: list[_Entry] = []

    def add(self, time_s: float, text: Callable[[], str], topic: str = "") -> None:
        """Add an event, or a message of a topic."""
        self._entries.append(_Entry(time_s, text, topic))

    def lines(self, until_s: float = inf, count: int = SHOWN) -> list[str]:
        """Return the last events until a time, the oldest first, each with its time in seconds.

        Of the messages of a topic, only the last few are shown.
        """
        shown: list[_Entry] = []
        topics: Counter[str] = Counter()
        entries = [entry for entry in self._entries if entry.time_s <= until_s]
        for entry in sorted(entries, key=lambda entry: entry.time_s)[::-1]:
            topics[entry.topic] += 1
            if not entry.topic or topics[entry.topic] <= _OF_TOPIC:
                shown.append(entry)
            if len(shown) == count:
                break
        return [f"{entry.time_s:9.3f}  {entry.text()}" for entry in reversed(shown)]


def unknown(text: str, name: str, names: Iterable[str]) -> TestFailure:
    """Return the failure for a name that does not exist, with the nearest one that does."""
    hint = suggestion(name, list(names))
    return TestFailure(text if hint is None else f"{text}; {hint}")


def unmet(condition: Callable[[], object], timeout_s: float) -> str:
    """Return the text for a condition that was not true in time."""
    name = getattr(condition, "__name__", "<lambda>")
    what = "the condition" if name == "<lambda>" else name
    return f"{what} was not true within {timeout_s:g} s"


def short(value: Any) -> str:
    """Return a message as one line, shortened."""
    text = str(value)
    return text if len(text) <= _LENGTH else f"{text[: _LENGTH - 3]}..."
