"""Requests of browsers, the errors that answer them, and JSON text for both."""

from __future__ import annotations

import json
import logging
import math
import os
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from composer.base.characters import escape_line
from composer.base.diagnostics import suggestion
from composer.base.fast_dataclass import dataclass
from composer.language.document.scalars import text_of_not_finite

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
T = TypeVar("T")

#: Integers beyond this are not exact in JavaScript, and are sent as text.
_EXACT = 2**53
_TYPE_NAMES = {str: "a string", bool: "true or false", dict: "an object", list: "an array"}
_MAX_ID = 64
#: How JSON writes a character beyond 16 bits, with another one after it.
_SURROGATE = "\\ud"


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


def unknown(what: str, name: str, choices: Iterable[str]) -> BadRequestError:
    """Return the error for a name that is none of the choices."""
    hint = suggestion(name, choices, limit=0)
    return BadRequestError(f"there is no {what} '{name:.80}'", hint)


@dataclass(frozen=True, slots=True)
class ClientRequest:
    """A request: ``id`` is the browser's, ``op`` what to do, ``values`` everything else.

    It has the characters of ``text``.
    """

    id: int | str
    op: str
    values: Mapping[str, Any]
    text: str


def parse_request(text: str | bytes) -> ClientRequest:
    """Return the request in a message of a browser. Raises BadRequestError."""
    if isinstance(text, bytes):
        raise BadRequestError("messages must be text, this one is binary")
    content = parse_object(text)
    identifier, op = content.pop("id", None), content.pop("op", None)
    is_text = isinstance(identifier, str) and len(identifier) <= _MAX_ID
    if not is_text and type(identifier) is not int:
        raise BadRequestError("'id' must be an integer or a short string")
    if not isinstance(op, str):
        raise BadRequestError("'op' must be a string")
    return ClientRequest(identifier, op, content, text)


def parse_object(text: str) -> dict[str, Any]:
    """Return the JSON object in a message. Raises BadRequestError."""
    try:
        content = json.loads(text, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise BadRequestError(f"the message is not valid JSON: {error!s:.120}") from error
    if not isinstance(content, dict):
        raise BadRequestError("the message is not a JSON object")
    return content


def check_characters(text: str, content: Mapping[str, Any]) -> None:
    """Raise BadRequestError if a text in an object, parsed from ``text``, is not Unicode."""
    try:
        if _SURROGATE in text.lower():
            json.dumps(content, ensure_ascii=False).encode()
    except UnicodeEncodeError as error:
        raise BadRequestError("the message has half of a surrogate pair in a text") from error


def _refuse_constant(name: str) -> None:
    raise ValueError(f"{name} is not a number in JSON")


class Values:
    """The keys of a request or of the parameters of a channel, read with their types.

    Every method raises BadRequestError. Call :meth:`end` at the end: unknown keys are errors.
    """

    def __init__(self, content: Any, what: str) -> None:
        if not isinstance(content, Mapping):
            raise BadRequestError(f"{what} must be an object")
        self._content = dict(content)
        self._known: list[str] = []
        self._what = what

    def text(self, key: str, default: str | None = None) -> str:
        """Return a string; it is required without a default."""
        return self._get(key, str, default)

    def flag(self, key: str, *, default: bool = False) -> bool:
        """Return true or false."""
        return self._get(key, bool, default)

    def number(self, key: str, default: float, low: float, high: float) -> float:
        """Return a number from ``low`` to ``high``."""
        value = self._content.get(key, default)
        self._known.append(key)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise BadRequestError(f"'{key}' must be a number")
        if not low <= value <= high:
            raise BadRequestError(f"'{key}' must be from {low:g} to {high:g}, not {value!r:.40}")
        return float(value)

    def mapping(self, key: str) -> Mapping[str, Any]:
        """Return an object; an empty one if it is absent."""
        return self._get(key, dict, {})

    def texts(self, key: str, limit: int) -> list[str]:
        """Return a list of at most ``limit`` strings; an empty one if it is absent."""
        found = self.items(key, limit)
        if not all(isinstance(item, str) for item in found):
            raise BadRequestError(f"'{key}' must be an array of strings")
        return found

    def items(self, key: str, limit: int) -> list[Any]:
        """Return a list of at most ``limit`` items; an empty one if it is absent."""
        found: list[Any] = self._get(key, list, [])
        if len(found) > limit:
            raise BadRequestError(f"'{key}' has {len(found)} items, at most {limit} are possible")
        return found

    def choice(self, key: str, choices: tuple[str, ...], default: str | None = None) -> str:
        """Return one of several strings."""
        value = self.text(key, default)
        if value not in choices:
            raise BadRequestError(f"'{key}' must be one of {', '.join(choices)}, not '{value:.80}'")
        return value

    def any(self, key: str) -> Any:
        """Return any value, which is required."""
        self._known.append(key)
        if key not in self._content:
            raise BadRequestError(f"{self._what} needs '{key}'")
        return self._content[key]

    def end(self) -> None:
        """Raise BadRequestError for a key that was not read."""
        for key in self._content:
            if key not in self._known:
                hint = suggestion(key, self._known, limit=0)
                raise BadRequestError(f"{self._what} has no key '{key:.80}'", hint)

    def _get(self, key: str, kind: type[T], default: T | None) -> T:
        self._known.append(key)
        value = self._content.get(key, default)
        if value is None and default is None:
            raise BadRequestError(f"{self._what} needs '{key}', {_TYPE_NAMES[kind]}")
        if not isinstance(value, kind):
            raise BadRequestError(f"'{key}' must be {_TYPE_NAMES[kind]}")
        return value


def to_json(value: Any) -> str:
    """Return compact JSON text of ASCII characters; numbers that JSON lacks become strings."""
    try:
        return json.dumps(value, separators=(",", ":"), allow_nan=False)
    except (ValueError, TypeError):
        return json.dumps(json_safe(value), separators=(",", ":"))


def json_safe(value: Any) -> Any:
    """Return plain data without NaN, infinities, and integers that JavaScript would round."""
    match value:
        case int() if not isinstance(value, bool):
            return value if -_EXACT <= value <= _EXACT else str(value)
        case float():
            return value if math.isfinite(value) else text_of_not_finite(value)
        case Mapping():
            return {str(key): json_safe(item) for key, item in value.items()}
        case list() | tuple():
            return [json_safe(item) for item in value]
        case _:
            return value if isinstance(value, bool | str | None) else str(value)
