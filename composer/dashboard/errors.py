"""Requests that fail, as a browser sees them."""

from __future__ import annotations

from typing import Any


class RequestError(Exception):
    """A request of a browser fails; ``code`` is for its program, the text for its user."""

    def __init__(self, code: str, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.code = code
        self.hint = hint

    def as_data(self) -> dict[str, Any]:
        """Return the error as it is sent."""
        return {"code": self.code, "message": str(self), "hint": self.hint}


class BadRequestError(RequestError):
    """The request is malformed."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__("bad_request", message, hint)
