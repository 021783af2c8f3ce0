"""The rules of ``include`` and ``extends``, and the limits for all that a system includes."""

from __future__ import annotations

from composer.base.diagnostics import Diagnostic, error
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.language.document.limits import (
    MAX_BYTES,
    MAX_INCLUDED_VALUES,
    MAX_INCLUDES,
    MAX_MATCHES,
)
from composer.language.rules import TOO_LARGE

INVALID_INCLUDE = error("RC290", "invalid-include")
UNKNOWN_OVERRIDE = error("RC293", "unknown-override")
UNKNOWN_BASE = error("RC295", "unknown-base")

#: Comparisons of names with patterns.
_MAX_COMPARISONS = 500_000


class LimitExceeded(Exception):
    """A system exceeds a limit; ``diagnostic`` says where."""

    def __init__(self, message: str, span: Span, hint: str) -> None:
        super().__init__(message)
        self.diagnostic = Diagnostic(TOO_LARGE, message, span, hint=hint)


@dataclass(slots=True)
class IncludeLimits:
    """Counts what a system includes. Each method raises LimitExceeded beyond its limit."""

    _includes: int = 0
    _characters: int = 0
    _values: int = 0
    _matches: int = 0
    _comparisons: int = 0

    def include(self, span: Span) -> None:
        """Count an included file, again if it is included again."""
        self._includes += 1
        if self._includes > MAX_INCLUDES:
            message = f"with this, the system includes more than {MAX_INCLUDES:,} files"
            hint = "put nodes that are always used together into one file"
            raise LimitExceeded(message, span, hint)

    def read(self, characters: int, span: Span) -> None:
        """Count the characters of a file that is read for the first time."""
        self._characters += characters
        if self._characters > MAX_BYTES:
            message = f"with this, the files of the system are larger than {MAX_BYTES:,} bytes"
            hint = "split the system, or declare repeated nodes once as a node type"
            raise LimitExceeded(message, span, hint)

    def add(self, values: int, span: Span) -> None:
        """Count the values of an expanded file."""
        self._values += values
        if self._values > MAX_INCLUDED_VALUES:
            message = f"with this, the system includes more than {MAX_INCLUDED_VALUES:,} values"
            hint = "split the system, or declare repeated nodes once as a node type"
            raise LimitExceeded(message, span, hint)

    def match(self, names: int, span: Span) -> None:
        """Count the nodes that a pattern stands for."""
        self._matches += names
        if self._matches > MAX_MATCHES:
            message = f"with this, patterns stand for more than {MAX_MATCHES:,} nodes"
            raise LimitExceeded(message, span, "use patterns that match fewer nodes")

    def compare(self, names: int, span: Span) -> None:
        """Count names that are compared with a pattern."""
        self._comparisons += names
        if self._comparisons > _MAX_COMPARISONS:
            message = "with this, the system compares too many node names with patterns"
            raise LimitExceeded(message, span, "use fewer patterns, or write out the names")
