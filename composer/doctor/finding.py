"""What a look at one thing has shown."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Level(StrEnum):
    """How much a finding weighs."""

    OK = "ok"
    NOTE = "note"
    WARNING = "warning"
    ERROR = "error"


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was looked at. Whatever is not well has a remedy, in the imperative."""

    area: str
    level: Level
    message: str
    remedy: str | None = None


def fine(area: str, message: str) -> Finding:
    """Return the finding that something is as it should be."""
    return Finding(area, Level.OK, message)


def note(area: str, message: str, remedy: str) -> Finding:
    """Return something that explains surprises and may well be wanted."""
    return Finding(area, Level.NOTE, message, remedy)


def warning(area: str, message: str, remedy: str) -> Finding:
    """Return something that is likely to go wrong."""
    return Finding(area, Level.WARNING, message, remedy)


def error(area: str, message: str, remedy: str) -> Finding:
    """Return something that does not work."""
    return Finding(area, Level.ERROR, message, remedy)
