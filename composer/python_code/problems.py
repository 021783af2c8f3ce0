"""A problem in a Python file: what is wrong, where, and which family it belongs to."""

from __future__ import annotations

from enum import Enum

from composer.base.diagnostics import error, info, warning
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.interfaces.field_types.types import INVALID_VALUE, UNKNOWN_FIELD


class Family(Enum):
    """The families of problems, each with its rule."""

    PORT = error("RC442", "unknown-attribute")
    FIELD = UNKNOWN_FIELD
    VALUE = INVALID_VALUE
    MESSAGE_TYPE = error("RC457", "wrong-message-type")
    AWAIT = error("RC443", "missing-await")
    NAME = warning("RC447", "undefined-name")
    IMPORT = error("RC444", "unknown-import")
    NOT_INSTALLED = info("RC445", "not-installed")
    ATTRIBUTE = warning("RC458", "missing-attribute")
    ARGUMENTS = warning("RC452", "call-arguments")
    TYPE = warning("RC455", "type-error")
    RETURN = error("RC448", "missing-return")
    NONE = warning("RC456", "unchecked-none")
    ASYNCIO = error("RC454", "asyncio-call")
    EARLY = warning("RC459", "too-early")
    FRAME = warning("RC309", "frame-id-slash")
    SIGNATURE = error("RC435", "handler-signature")
    PARAMETER = error("RC483", "undeclared-parameter")
    CONSTRUCTOR = error("RC484", "missing-constructor")
    SELF = error("RC449", "missing-self")
    SYNTAX = error("RC441", "python-syntax")
    NOT_CHECKED = info("RC437", "not-checked")


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
