"""A compiled expression and what is known of it before it is evaluated."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import CodeType, TracebackType
from typing import Any

from composer.expressions.errors import EvaluationError, Refusal
from composer.expressions.operations import kind_of

_LONGEST_PART = 80


class Result(StrEnum):
    """What kind of value an expression has, as far as its form tells."""

    PATH = "path"  # it is one field path: whatever that field is
    NUMBER = "number"
    INTEGER = "integer"
    BOOL = "bool"
    TEXT = "text"
    UNKNOWN = "unknown"  # depends on the values


@dataclass(frozen=True, slots=True)
class FieldPath:
    """A use of a name: ``("message", "poses", 0, "pose")``. Offset and length are in characters
    of the expression's source."""

    parts: tuple[str | int, ...]
    offset: int = field(compare=False)
    length: int = field(compare=False)

    @property
    def root(self) -> str:
        """The name in scope that the path starts from."""
        return str(self.parts[0])

    def __str__(self) -> str:
        steps = (f"[{part}]" if isinstance(part, int) else f".{part}" for part in self.parts[1:])
        return self.root + "".join(steps)


@dataclass(frozen=True, slots=True)
class Expression:
    """An expression ready to be evaluated. Two are equal when their sources are."""

    source: str
    paths: tuple[FieldPath, ...] = field(compare=False)
    result: Result = field(compare=False)
    function: Callable[[Mapping[str, Any]], Any] = field(compare=False, repr=False)

    def evaluate(self, scope: Mapping[str, Any]) -> Any:
        """Return the value with the names in ``scope``: messages and maps are read, not changed.

        Raises EvaluationError, and nothing else, when there is none.
        """
        try:
            return self.function(scope)
        except Exception as error:
            raise EvaluationError(self._explain(error)) from error

    def holds(self, scope: Mapping[str, Any]) -> bool:
        """Return the value of a condition. Raises EvaluationError when it is not a bool."""
        value = self.evaluate(scope)
        if not isinstance(value, bool):
            kind = kind_of(type(value)).value
            raise EvaluationError(f"'{_cut(self.source)}': {kind} where true or false is expected")
        return value

    def __str__(self) -> str:
        return self.source

    def _explain(self, error: Exception) -> str:
        code: CodeType = self.function.__code__  # type: ignore[attr-defined]
        part = _failed_part(self.source, code, error.__traceback__)
        return f"'{_cut(part)}': {_reason(error)}"


def _reason(error: Exception) -> str:
    match error:
        case Refusal():
            return str(error)
        case KeyError():
            return "there is no such name here"
        case ZeroDivisionError():
            return "division by zero"
        case OverflowError():
            return "the number is too large"
        case TypeError():
            return "the values have no order"
        case ValueError():
            return "not defined for this value"
        case _:
            return f"{type(error).__name__} while reading the value"


def _failed_part(source: str, code: CodeType, traceback: TracebackType | None) -> str:
    """Return the part of the source that was being worked out, by the code's position table."""
    while traceback is not None and traceback.tb_frame.f_code is not code:
        traceback = traceback.tb_next
    if traceback is None:
        return source
    positions = list(code.co_positions())
    _, _, start, end = positions[traceback.tb_lasti // 2]
    if start is None or end is None:  # python -X no_debug_ranges
        return source
    return source.encode()[start:end].decode(errors="replace")


def _cut(text: str) -> str:
    flat = " ".join(text.split())
    return flat if len(flat) <= _LONGEST_PART else flat[: _LONGEST_PART - 3] + "..."
