"""Which lines of a log to show."""

from __future__ import annotations

import re
from datetime import datetime, timedelta
from fnmatch import fnmatchcase

from composer.base.fast_dataclass import dataclass
from composer.client.run_log.record import Record

LEVELS = ("debug", "info", "warn", "error", "fatal")
_SECOND_NS = 1_000_000_000
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
