"""The rules: one rule, one file, in one package per subject.

Every module of these packages with a function ``check`` is a rule and is found automatically. Its
``RULE`` holds the documentation (see CONTRIBUTING for how to add a rule). A check reports one kind
of problem and skips input that is itself invalid, because another rule reports that.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from importlib import import_module
from pathlib import Path

from composer.analysis.context import Context, location
from composer.analysis.formatting import with_short_values
from composer.diagnostics import Diagnostic, Severity, in_order

Check = Callable[[Context], Iterator[Diagnostic]]


def run_checks(context: Context) -> list[Diagnostic]:
    """Return the diagnostics of all rules, sorted by location.

    Locations that an earlier stage reported are skipped, and warnings on lines with its errors.
    """
    refused = {location(span) for span in context.refused}
    refused_lines = {(file, line) for file, line, _ in refused}
    found = [
        with_short_values(diagnostic)
        for check in all_checks()
        for diagnostic in check(context)
        if location(diagnostic.primary) not in refused
        and (
            diagnostic.severity is Severity.ERROR
            or location(diagnostic.primary)[:2] not in refused_lines
        )
    ]
    return in_order(_without_repeats(found))


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


__all__ = ["Check", "Context", "all_checks", "run_checks"]
