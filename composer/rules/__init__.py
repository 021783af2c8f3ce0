"""The rules, in one module per subject.

Every function of these modules whose name begins with ``check`` is found automatically. It yields
the diagnostics of one rule, or of a few about the same values. The pages in ``docs/rules`` document
the rules (see CONTRIBUTING for how to add one). A check skips input that is itself invalid, because
another rule reports that.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache
from importlib import import_module
from pathlib import Path

from composer.base.diagnostics import Diagnostic, Severity, in_order
from composer.language.rules import LimitedDiagnostics, TooManyErrors
from composer.rules.analysis.context import Check, Context, location
from composer.rules.analysis.formatting import with_short_values


def run_checks(context: Context) -> list[Diagnostic]:
    """Return the diagnostics of all rules, sorted by location."""
    found: list[Diagnostic] = LimitedDiagnostics()
    try:
        found += reported(context, (item for check in all_checks() for item in check(context)))
    except TooManyErrors as stopped:
        found = stopped.diagnostics
    return in_order(found)


def reported(context: Context, diagnostics: Iterable[Diagnostic]) -> Iterator[Diagnostic]:
    """Leave out locations that an earlier stage reported, and warnings on lines with its errors."""
    refused = {location(span) for span in context.refused}
    refused_lines = {(file, line) for file, line, _ in refused}
    for diagnostic in diagnostics:
        place = location(diagnostic.primary)
        is_error = diagnostic.severity is Severity.ERROR
        if place not in refused and (is_error or place[:2] not in refused_lines):
            yield with_short_values(diagnostic)


@cache
def all_checks() -> tuple[Check, ...]:
    """Return the checks of all modules, sorted by module and name."""
    folder = Path(__file__).parent
    modules = [
        import_module(f"{__name__}.{file.stem}") for file in sorted(folder.glob("[a-z]*.py"))
    ]
    return tuple(
        function
        for module in modules
        for name, function in sorted(vars(module).items())
        if name.startswith("check") and getattr(function, "__module__", "") == module.__name__
    )


__all__ = ["Check", "Context", "all_checks", "reported", "run_checks"]
