"""Requests that fail, as a browser sees them."""

from __future__ import annotations

import logging
import os
from typing import TYPE_CHECKING, Any

from composer.base.characters import escape_line

if TYPE_CHECKING:
    from composer.client.session import RosError

#: The codes of errors of :mod:`composer.client`, by the names of their classes: importing these
#: imports ROS.
_CODES = {
    "NoResponseError": "no_response",
    "NotFoundError": "not_found",
    "UnknownParameterError": "not_found",
    "InvalidValueError": "bad_request",
    "InvalidNameError": "bad_request",
    "ParameterRejectedError": "rejected",
    "GoalRejectedError": "rejected",
    "TransitionError": "rejected",
}


class RequestError(Exception):
    """A request of a browser fails; ``code`` is for its program, the text for its user."""

    def __init__(self, code: str, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.code = code
        self.hint = hint

    def as_data(self) -> dict[str, Any]:
        """Return the error as it is sent."""
        return {"code": self.code, "message": str(self), "hint": self.hint}


def from_ros(error: RosError) -> RequestError:
    """Return the same error for a browser."""
    names = {kind.__name__ for kind in type(error).__mro__}
    code = next((code for kind, code in _CODES.items() if kind in names), "failed")
    return RequestError(code, str(error), error.hint)


def internal_error(what: str, error: Exception) -> RequestError:
    """Return the error for a defect of the dashboard, and log it.

    That takes one line, as a message may cause it; with COMPOSE_DEBUG, the traceback follows.
    """
    trace = error if os.environ.get("COMPOSE_DEBUG") else None
    text = escape_line(f"{error!r:.200}")
    logging.getLogger(__name__).error("%s failed: %s", escape_line(what), text, exc_info=trace)
    return RequestError("internal", f"an internal error of the dashboard: {text}")


class BadRequestError(RequestError):
    """The request is malformed."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__("bad_request", message, hint)
