"""What can go wrong with an expression: as it is written, and as it is worked out."""

from __future__ import annotations


class ExpressionError(Exception):
    """The text is no expression of the language.

    ``offset`` and ``length`` give the part that is wrong, in characters of the source; ``hint``
    says how to mend it, where that is known.
    """

    def __init__(self, message: str, offset: int = 0, length: int = 1, hint: str | None = None):
        super().__init__(message)
        self.message = message
        self.offset = offset
        self.length = max(length, 1)
        self.hint = hint


class EvaluationError(Exception):
    """The expression has no value for the values it was given. The text names the part."""


class Refusal(Exception):
    """An operation does not take the value at hand; becomes an EvaluationError."""
