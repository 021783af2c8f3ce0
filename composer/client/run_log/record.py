"""One line of a log file, and which lines to show."""

from __future__ import annotations

import json
import re
from datetime import UTC, datetime, timedelta
from fnmatch import fnmatchcase
from typing import Any

from composer.base.characters import escape_line
from composer.base.fast_dataclass import dataclass

_MICROSECOND_NS = 1000
_SECOND_NS = 1_000_000_000
_END_NS = 2**63  # of the times of ROS, in the year 2262


@dataclass(frozen=True, slots=True)
class Record:
    """A line of the log. ``time_ns`` counts from the Unix epoch.

    ``logger`` is the name of the logger, such as ``planning.planner``; ``node`` the full name of
    the node that the line is about, or empty. ``level`` is in lower case, such as ``warn``.
    """

    time_ns: int
    level: str
    logger: str
    node: str
    message: str

    def content(self) -> dict[str, str]:
        """Return the record as plain data; the time is in UTC, with microseconds."""
        seconds, rest_ns = divmod(self.time_ns, _SECOND_NS)
        time = datetime.fromtimestamp(seconds, UTC).replace(microsecond=rest_ns // _MICROSECOND_NS)
        return {
            "time": time.isoformat(timespec="microseconds").replace("+00:00", "Z"),
            "level": self.level,
            "node": self.node,
            "logger": self.logger,
            "message": self.message,
        }

    def to_line(self) -> str:
        """Return the record as a line of JSON, with its newline."""
        return f"{json.dumps(self.content(), ensure_ascii=False)}\n"


def parse_line(line: bytes) -> Record | None:
    """Return the record in a line of a log file; None if it is not one, as after a full disk.

    All but the message is safe to be shown in one line.
    """
    try:
        content: dict[str, Any] = json.loads(line)
        texts = {key: content[key] for key in ("level", "logger", "node", "message")}
        since_epoch = datetime.fromisoformat(content["time"]) - _EPOCH
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
        return None
    seconds = since_epoch.days * 86_400 + since_epoch.seconds
    time_ns = seconds * _SECOND_NS + since_epoch.microseconds * _MICROSECOND_NS
    if not (0 <= time_ns < _END_NS and all(isinstance(text, str) for text in texts.values())):
        return None
    message = texts.pop("message")
    safe = {key: escape_line(text) for key, text in texts.items()}
    return Record(time_ns=time_ns, message=message, **safe)


_EPOCH = datetime.fromtimestamp(0, UTC)


LEVELS = ("debug", "info", "warn", "error", "fatal")
_PART = re.compile(r"(\d+(?:\.\d+)?)(ms|s|m|h|d)")
_UNITS_S = {"ms": 0.001, "s": 1.0, "m": 60.0, "h": 3600.0, "d": 86_400.0}


@dataclass(frozen=True, slots=True)
class Selection:
    """Selects records by their node, time and level.

    ``nodes`` are full names, last parts of names, or patterns; without any, all nodes are selected.
    ``level`` is the minimum level.
    """

    nodes: tuple[str, ...] = ()
    since_ns: int = 0
    level: str = LEVELS[0]

    def __contains__(self, record: Record) -> bool:
        return (
            record.time_ns >= self.since_ns
            and _rank(record.level) >= _rank(self.level)
            and (not self.nodes or any(is_of_node(record, node) for node in self.nodes))
        )


def is_of_node(record: Record, name: str) -> bool:
    """Return whether a record is about a node, or of a child of its logger."""
    name = name if name.startswith("/") else f"*/{name}"
    return fnmatchcase(record.node, name) or fnmatchcase(record.node, f"{name}/*")


def parse_since(text: str, now: datetime) -> int | None:
    """Return the time of ``text`` in nanoseconds since the epoch; None if it is not one.

    It is a duration before ``now``, such as ``10m`` or ``1h30m``, or a time in ISO 8601, by default
    in the local time zone.
    """
    parts = _PART.findall(text)
    try:
        if parts and "".join(number + unit for number, unit in parts) == text:
            seconds = sum(float(number) * _UNITS_S[unit] for number, unit in parts)
            at = now - timedelta(seconds=seconds)
        else:
            at = datetime.fromisoformat(text)
        return int(at.timestamp() * _SECOND_NS)
    except (ValueError, OverflowError, OSError):
        return None


def _rank(level: str) -> int:
    """Return the rank of a level; an unknown one is shown in any case."""
    return LEVELS.index(level) if level in LEVELS else len(LEVELS)
