"""A problem in the code of a behavior."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from enum import Enum

from composer.behavior_source import Function, Module
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
    INDEX = "an element that a list or an array parameter does not have"
    CHANGED = "an attribute that gets a value of another kind"
    NONE = "a value that may be None"
    ANNOTATION = "a handler that annotates its argument with another type"
    SIGNATURE = "a callback that does not accept the arguments it is called with"
    REFUSED = "values of parameters for which 'on_configure' raises"
    PARAMETER = "a parameter that a class reads, but does not declare"
    CONSTRUCTOR = "a constructor that does not call that of Node"


@dataclass(frozen=True, slots=True)
class CodeProblem:
    """A problem, its location in Python and a hint.

    ``about`` is the name of what has the wrong value, by default the text at its location.
    ``lines`` are the first and last line of a function that lacks names because of the problem.
    ``called`` is the function of the project that a call does not fit, with its file. ``cause`` is
    the value in another file that the code does not expect.
    """

    kind: Kind
    message: str
    span: Span
    hint: str | None = None
    about: str = ""
    lines: tuple[int, int] | None = None
    called: tuple[Function, Module] | None = None
    cause: Span | None = None

    @property
    def attribute(self) -> str:
        """The attribute of the object whose value has a wrong type, "" for other problems."""
        name = self.about if self.kind is Kind.VALUE else ""
        return name if name.startswith("self.") and name.count(".") == 1 else ""


#: The kinds of which one wrong value causes several.
_OF_VALUES = frozenset({Kind.CALL, Kind.FIELD, Kind.INDEX, Kind.VALUE})


def distinct(problems: Iterable[CodeProblem]) -> Iterator[CodeProblem]:
    """Yield the problems in a function without those that another one has caused.

    These are further uses of the same wrong value, and the parts of an expression that is wrong.
    """
    blamed: set[str] = set()
    wrong: list[Span] = []
    for problem in problems:
        if problem.kind in _OF_VALUES:
            about = problem.about or _named(problem.span)
            is_same = problem.kind is Kind.FIELD and problem.message in blamed
            if about in blamed or is_same or any(_is_within(problem.span, at) for at in wrong):
                continue
            blamed.update({about, problem.message} - {""})
            wrong.append(problem.span)
        yield problem


def _named(span: Span) -> str:
    text = span.file.line(span.line)[span.column - 1 : span.column - 1 + span.length]
    return text if text.replace(".", "").isidentifier() else ""


def _is_within(span: Span, other: Span) -> bool:
    end = other.column + other.length
    return span.line == other.line and other.column <= span.column < end
