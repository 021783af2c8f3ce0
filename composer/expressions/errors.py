"""Errors of expressions, when they are compiled or evaluated."""

from __future__ import annotations


class ExpressionError(Exception):
    """The text is not a valid expression.

    ``offset`` and ``length`` are the invalid part in characters of the source; ``hint`` says how to
    fix it, if that is clear.
    """

    def __init__(self, message: str, offset: int = 0, length: int = 1, hint: str | None = None):
        super().__init__(message)
        self.message = message
        self.offset = offset
        self.length = max(length, 1)
        self.hint = hint


class EvaluationError(Exception):
    """The expression cannot be evaluated with the given values. The text names the part."""


class Refusal(Exception):
    """An operation does not support a value; becomes an EvaluationError."""
