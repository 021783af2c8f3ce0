"""The rules, in one package per subject.

Every module of these packages with a function ``check`` is found automatically; it has one rule, or
a few about the same subject. A rule holds its documentation (see CONTRIBUTING for how to add one).
A check skips input that is itself invalid, because another rule reports that.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cache
from importlib import import_module
from pathlib import Path

from composer.analysis.context import Context, location
from composer.analysis.formatting import with_short_values
from composer.diagnostics import Diagnostic, Severity, in_order

Check = Callable[[Context], Iterator[Diagnostic]]


def run_checks(context: Context) -> list[Diagnostic]:
    """Return the diagnostics of all rules, sorted by location."""
    found = reported(context, (item for check in all_checks() for item in check(context)))
    return in_order(_without_repeats(found))


def reported(context: Context, diagnostics: Iterable[Diagnostic]) -> list[Diagnostic]:
    """Leave out locations that an earlier stage reported, and warnings on lines with its errors."""
    refused = {location(span) for span in context.refused}
    refused_lines = {(file, line) for file, line, _ in refused}
    return [
        with_short_values(diagnostic)
        for diagnostic in diagnostics
        if location(diagnostic.primary) not in refused
        and (
            diagnostic.severity is Severity.ERROR
            or location(diagnostic.primary)[:2] not in refused_lines
        )
    ]


def _without_repeats(found: list[Diagnostic]) -> list[Diagnostic]:
    """Leave out ports that are connected twice because a connection has the wrong ones."""
    wrong = {location(item.primary) for item in found if item.rule.name == "wrong-port-kind"}
    return [
        item
        for item in found
        if item.rule.name != "port-connected-twice" or location(item.primary) not in wrong
    ]


@cache
def all_checks() -> tuple[Check, ...]:
    """Return the ``check`` function of every rule, sorted by module name."""
    folder = Path(__file__).parent
    files = sorted(folder.rglob("[a-z]*.py"), key=lambda path: path.stem)
    names = (".".join(path.relative_to(folder).with_suffix("").parts) for path in files)
    modules = (import_module(f"{__name__}.{name}") for name in names)
    return tuple(module.check for module in modules if hasattr(module, "check"))


__all__ = ["Check", "Context", "all_checks", "reported", "run_checks"]
