"""One line of a log file."""

from __future__ import annotations

import json
from datetime import UTC, datetime
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
