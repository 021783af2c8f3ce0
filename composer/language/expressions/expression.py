"""Compiled expressions."""

from __future__ import annotations

import ast
from collections.abc import Callable, Container, Mapping
from dataclasses import field
from itertools import takewhile
from types import CodeType, TracebackType
from typing import Any, TypeAlias

from composer.base.diagnostics import shown
from composer.base.fast_dataclass import dataclass
from composer.language.expressions.values import EvaluationError, Refusal, describe, map_key

_REASONS: Mapping[type[Exception], str] = {
    KeyError: "there is no such name here",
    ZeroDivisionError: "division by zero",
    OverflowError: "the number is too large",
    TypeError: "a string and a number have no order",
    ValueError: "not defined for this value",
}


#: Returns the value of an expression with the names in a scope.
Function: TypeAlias = Callable[[Mapping[str, Any]], Any]


def _is_name(part: str | int) -> bool:
    return isinstance(part, str)


@dataclass(frozen=True, slots=True)
class FieldPath:
    """A use of a name: ``("message", "poses", 0, "pose")``.

    ``offset`` and ``length`` count characters of the source.
    """

    parts: tuple[str | int, ...]
    offset: int = field(compare=False)
    length: int = field(compare=False)

    @property
    def root(self) -> str:
        """The name in scope at the start of the path."""
        return str(self.parts[0])

    def key(self, known: Container[str]) -> str:
        """Return the key that the path reads from its root, a map with the keys ``known``."""
        names = tuple(str(part) for part in takewhile(_is_name, self.parts[1:]))
        return map_key(known, names)[0] if names else ""

    def __str__(self) -> str:
        steps = (f"[{part}]" if isinstance(part, int) else f".{part}" for part in self.parts[1:])
        return self.root + "".join(steps)


@dataclass(frozen=True, slots=True)
class Expression:
    """A compiled expression. Expressions with the same source are equal.

    ``tree`` is its syntax tree, for type inference; columns in it count
    characters of the source. ``compile`` returns its
    ``function``, which is made when it is first evaluated.
    """

    source: str
    paths: tuple[FieldPath, ...] = field(compare=False)
    tree: ast.expr = field(compare=False, repr=False)
    compile: Callable[[], Function] = field(compare=False, repr=False)
    function: Function | None = field(default=None, compare=False, repr=False)

    def evaluate(self, scope: Mapping[str, Any]) -> Any:
        """Return the value with the names in ``scope``: messages and maps are read, not changed.

        Raises EvaluationError, and nothing else, when there is none.
        """
        try:
            return (self.function or self._compiled())(scope)
        except Exception as error:
            raise EvaluationError(self._explain(error)) from error

    def holds(self, scope: Mapping[str, Any]) -> bool:
        """Return the value of a condition. Raises EvaluationError unless it is a boolean."""
        value = self.evaluate(scope)
        if not isinstance(value, bool):
            message = f"'{shown(self.source)}': {describe(value)} where true or false is expected"
            raise EvaluationError(message)
        return value

    def __str__(self) -> str:
        return self.source

    def _compiled(self) -> Function:
        function = self.compile()
        object.__setattr__(self, "function", function)
        return function

    def _explain(self, error: Exception) -> str:
        code: CodeType = (self.function or self._compiled()).__code__
        part = _failed_part(self.source, code, error.__traceback__)
        return f"'{shown(part)}': {_reason(error)}"


def _reason(error: Exception) -> str:
    if isinstance(error, Refusal):
        return str(error)
    reason = _REASONS.get(type(error))
    return reason or f"{type(error).__name__} while the value was read"


def _failed_part(source: str, code: CodeType, traceback: TracebackType | None) -> str:
    """Return the part of the source that failed, from the code's position table."""
    while traceback is not None and traceback.tb_frame.f_code is not code:
        traceback = traceback.tb_next
    if traceback is None:
        return source
    _, _, start, end = list(code.co_positions())[traceback.tb_lasti // 2]
    return source if start is None or end is None else source[start:end]
