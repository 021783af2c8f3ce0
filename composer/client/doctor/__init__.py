"""Checks of the ROS 2 setup of a computer, each with a remedy.

Only ``graph`` imports rclpy. The other checks also work without it.
"""

from __future__ import annotations

from enum import StrEnum

from composer.base.fast_dataclass import dataclass


class Level(StrEnum):
    """The severity of a result."""

    OK = "ok"
    NOTE = "note"
    WARNING = "warning"
    ERROR = "error"


@dataclass(frozen=True, slots=True)
class CheckResult:
    """The result of a check. All but OK results have a remedy, in the imperative."""

    area: str
    level: Level
    message: str
    remedy: str | None = None


def ok(area: str, message: str) -> CheckResult:
    """Return a result without a problem."""
    return CheckResult(area, Level.OK, message)


def note(area: str, message: str, remedy: str) -> CheckResult:
    """Return a result that may be intended, but can be surprising."""
    return CheckResult(area, Level.NOTE, message, remedy)


def warning(area: str, message: str, remedy: str) -> CheckResult:
    """Return a result that is likely to cause problems."""
    return CheckResult(area, Level.WARNING, message, remedy)


def error(area: str, message: str, remedy: str) -> CheckResult:
    """Return a result for something that does not work."""
    return CheckResult(area, Level.ERROR, message, remedy)
