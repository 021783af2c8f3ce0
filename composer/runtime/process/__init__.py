"""What concerns the whole process: environment, DDS profiles, instance lock, signals, exit."""

from __future__ import annotations


class StartRefused(Exception):
    """The environment does not allow a start. ``hint`` is how to fix that."""

    def __init__(self, message: str, hint: str) -> None:
        super().__init__(message)
        self.hint = hint
