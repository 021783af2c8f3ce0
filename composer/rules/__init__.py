"""The rules: one rule, one file.

Every module here with a function ``check`` is a rule and is found automatically. Its ``RULE`` holds
the documentation (see CONTRIBUTING for how to add a rule). A check reports one kind of problem and
skips input that is itself invalid, because another rule reports that.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from importlib import import_module
from pathlib import Path

from composer.analysis.context import Context, location
from composer.analysis.formatting import with_short_values
from composer.diagnostics import Diagnostic, in_order

Check = Callable[[Context], Iterator[Diagnostic]]


def run_checks(context: Context) -> list[Diagnostic]:
    """Return the diagnostics of all rules, sorted by location.

    Locations that an earlier stage reported are skipped.
    """
    refused = {location(span) for span in context.refused}
    return in_order(
        with_short_values(diagnostic)
        for check in all_checks()
        for diagnostic in check(context)
        if location(diagnostic.primary) not in refused
    )


@cache
def all_checks() -> tuple[Check, ...]:
    """Return the ``check`` function of every rule, sorted by module name."""
    names = sorted(path.stem for path in Path(__file__).parent.glob("[a-z]*.py"))
    modules = (import_module(f"{__name__}.{name}") for name in names)
    return tuple(module.check for module in modules if hasattr(module, "check"))


__all__ = ["Check", "Context", "all_checks", "run_checks"]
