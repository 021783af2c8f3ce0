"""A problem in a Python file: what is wrong, where, and which family it belongs to."""

from __future__ import annotations

from enum import Enum

from composer.fast_dataclass import dataclass
from composer.source import Span


class Family(Enum):
    """The families of problems; each has its rule."""

    PORT = "a port, parameter or attribute of the API that does not exist"
    FIELD = "a message, service or action without a field or part of that name"
    VALUE = "a value that does not fit the field of a message"
    MESSAGE_TYPE = "a message of another type than the port has"
    AWAIT = "an asynchronous call that is not awaited"
    NAME = "a name that is not defined"
    IMPORT = "an import that fails"
    NOT_INSTALLED = "an import of a module that is not installed here"
    INTERNAL = "an import of an internal module of the composer"
    ATTRIBUTE = "an attribute that an object does not have"
    ARGUMENTS = "a call with arguments that the function does not take"
    TYPE = "an operation that the types of its values do not allow"
    RETURN = "a function that returns something else than expected"
    NONE = "a value that may be None, used without a check"
    ANNOTATION = "a handler that annotates its argument with another type"
    UNUSED = "a statement without effect"
    ASYNCIO = "an awaited function of asyncio"
    BLOCKING = "a callback that blocks its executor"
    EARLY = "a use of the node before it is ready for it"
    FRAME = "a frame ID that begins with a slash"
    SIGNATURE = "a callback that does not accept the arguments it is called with"
    PARAMETER = "a parameter that a class reads, but does not declare"
    CONSTRUCTOR = "a constructor or transition that does not call that of its base class"
    SELF = "a method that lacks self"
    INDEX = "an element that an array does not have"
    SYNTAX = "code that Python refuses to compile"
    NOT_CHECKED = "code that was not checked"


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
