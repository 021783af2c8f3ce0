"""The rules of ``include`` and ``extends``, and the limits for all that a system includes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping as Map
from typing import NamedTuple

from composer.base.diagnostics import Diagnostic, error
from composer.base.source import Span
from composer.language.rules import (
    MAX_BYTES,
    MAX_DECLARED_VALUES,
    MAX_INCLUDED_VALUES,
    MAX_INCLUDES,
    MAX_MATCHES,
    MAX_PASSED_SECTIONS,
    TOO_LARGE,
    Stopped,
    TooManyErrors,
)

INVALID_INCLUDE = error("RC290", "invalid-include")
UNKNOWN_OVERRIDE = error("RC293", "unknown-override")
UNKNOWN_BASE = error("RC295", "unknown-base")
_SPLIT = "split the system, or declare repeated nodes once as a node type"


def exceeded(message: str, span: Span, hint: str) -> Stopped:
    """Return what ends the assembly of a system that exceeds a limit."""
    return Stopped(Diagnostic(TOO_LARGE, message, span, hint=hint))


class _Limit(NamedTuple):
    maximum: int
    problem: str
    hint: str


_LIMITS: Map[str, _Limit] = {
    "includes": _Limit(
        MAX_INCLUDES,
        f"with this, the system includes more than {MAX_INCLUDES:,} files",
        "put nodes that are always used together into one file",
    ),
    "characters": _Limit(
        MAX_BYTES, f"with this, the files of the system are larger than {MAX_BYTES:,} bytes", _SPLIT
    ),
    "values": _Limit(
        MAX_INCLUDED_VALUES,
        f"with this, the system includes more than {MAX_INCLUDED_VALUES:,} values",
        _SPLIT,
    ),
    "matches": _Limit(
        MAX_MATCHES,
        f"with this, patterns stand for more than {MAX_MATCHES:,} nodes",
        "use patterns that match fewer nodes",
    ),
    "comparisons": _Limit(
        500_000,
        "with this, the system compares too many node names with patterns",
        "use fewer patterns, or write out the names",
    ),
    "declared": _Limit(
        MAX_DECLARED_VALUES,
        f"with this node, the nodes declare more than {MAX_DECLARED_VALUES:,} values, "
        "counting expressions by their length",
        "split the system",
    ),
    "sections": _Limit(
        MAX_PASSED_SECTIONS,
        f"with this node, the nodes get more than {MAX_PASSED_SECTIONS:,} sections of "
        "parameter files, counting each node again",
        "split the parameter files",
    ),
}


class SystemLimits:
    """Counts what a system includes and declares.

    ``includes`` are files, each time that they are included; ``characters`` are those of each file
    once; ``values`` those of expanded files; ``matches`` and ``comparisons`` are of patterns.
    ``declared`` are keys and values that nodes declare; each node counts its node type again.
    ``sections`` are the sections of parameter files that nodes get.
    """

    def __init__(self, diagnostics: list[Diagnostic]) -> None:
        """``diagnostics`` are reported beyond a limit, too."""
        self._diagnostics = diagnostics
        self._counts: Counter[str] = Counter()

    def count(self, what: str, number: int, span: Span) -> None:
        """Add to a count. Raises TooManyErrors beyond its limit."""
        self._counts[what] += number
        limit = _LIMITS[what]
        if self._counts[what] > limit.maximum:
            diagnostic = Diagnostic(TOO_LARGE, limit.problem, span, hint=limit.hint)
            raise TooManyErrors(self._diagnostics, diagnostic)
