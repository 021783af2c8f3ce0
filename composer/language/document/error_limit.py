"""The number of errors that are reported of one file."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Self

from composer.base.diagnostics import Diagnostic, Severity
from composer.language.document.limits import MAX_ERRORS
from composer.language.document.rules import TOO_LARGE


class TooManyErrors(Exception):
    """A stage has found more than MAX_ERRORS errors: the ``first`` ones, and what says so."""

    def __init__(self, first: list[Diagnostic], diagnostic: Diagnostic) -> None:
        super().__init__(diagnostic.message)
        self.diagnostic = diagnostic
        self.diagnostics = [*first, diagnostic]


class LimitedDiagnostics(list[Diagnostic]):
    """The diagnostics of one stage. Raises TooManyErrors where there are too many errors.

    An error costs more time than a valid value, as the nearest names are searched for.
    """

    def __init__(self) -> None:
        super().__init__()
        self._errors = 0

    def append(self, item: Diagnostic) -> None:
        """Add a diagnostic. Raises TooManyErrors."""
        self._errors += item.severity is Severity.ERROR
        if self._errors > MAX_ERRORS:
            message = f"there are more than {MAX_ERRORS:,} errors; the rest is not checked"
            raise TooManyErrors([*self], Diagnostic(TOO_LARGE, message, item.primary))
        super().append(item)

    def __iadd__(self, items: Iterable[Diagnostic]) -> Self:  # type: ignore[misc,override]
        for item in items:
            self.append(item)
        return self
