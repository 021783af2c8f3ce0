"""Why nothing was started: said by whoever finds out, shown by the command."""

from __future__ import annotations


class StartRefused(Exception):
    """The environment does not allow a start. ``hint`` says what to do."""

    def __init__(self, message: str, hint: str) -> None:
        super().__init__(message)
        self.hint = hint
