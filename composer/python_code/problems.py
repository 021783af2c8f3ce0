"""A problem in a Python file: what is wrong, where, and which family it belongs to."""

from __future__ import annotations

from enum import Enum

from composer.base.fast_dataclass import dataclass
from composer.base.source import Span


class Family(Enum):
    """The families of problems, with the names of their rules."""

    PORT = "unknown-attribute"
    FIELD = "unknown-field"
    VALUE = "invalid-value"
    MESSAGE_TYPE = "wrong-message-type"
    AWAIT = "missing-await"
    NAME = "undefined-name"
    IMPORT = "unknown-import"
    NOT_INSTALLED = "not-installed"
    ATTRIBUTE = "missing-attribute"
    ARGUMENTS = "call-arguments"
    TYPE = "type-error"
    RETURN = "missing-return"
    NONE = "unchecked-none"
    ASYNCIO = "asyncio-call"
    EARLY = "too-early"
    FRAME = "frame-id-slash"
    SIGNATURE = "handler-signature"
    PARAMETER = "undeclared-parameter"
    CONSTRUCTOR = "missing-constructor"
    SELF = "missing-self"
    SYNTAX = "python-syntax"
    NOT_CHECKED = "not-checked"


@dataclass(frozen=True, slots=True)
class Problem:
    """A problem, its location in a Python file and a hint.

    ``is_certain`` is false for what may still work, such as a value that may be None: it is then a
    warning even if its rule is an error.
    """

    family: Family
    message: str
    span: Span
    hint: str | None = None
    is_certain: bool = True


class CheckerFailed(Exception):
    """The type checker cannot run or has no result; the message is the reason."""
