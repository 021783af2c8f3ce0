"""A problem in the code of a behavior."""

from __future__ import annotations

from enum import Enum

from composer.fast_dataclass import dataclass
from composer.source import Span


class Kind(Enum):
    """The kinds of problems; each has its rule."""

    FIELD = "a message, service or action without a field or part of that name"
    VALUE = "a value that does not fit a field or a port"
    ATTRIBUTE = "an attribute that self, its ports or its parameters do not have"
    AWAIT = "an asynchronous call that is not awaited"
    IMPORT = "an import that fails"
    NOT_INSTALLED = "an import of a module that is not installed here"
    INTERNAL = "an import of an internal module of the composer"
    NAME = "a name that is not defined"
    FRAME = "a frame ID that begins with a slash"
    CALL = "a call with arguments that the function does not take"
    UNUSED = "a comparison or a function whose value is not used"
    ASYNCIO = "an awaited function of asyncio"
    RETURN = "a function that may not return what its annotation says"
    INDEX = "an element that an array parameter does not have"
    ANNOTATION = "a handler that annotates its argument with another type"


@dataclass(frozen=True, slots=True)
class CodeProblem:
    """A problem, its location in Python and a hint."""

    kind: Kind
    message: str
    span: Span
    hint: str | None = None
