"""What can be wrong with a system: one rule, one file.

A module here that has a function ``check`` is a rule: it is found by being here. It has ``RULE``
too, with all that people are told of it (CONTRIBUTING says how to add one). A check looks at one
thing only, and stays silent where what it needs is itself wrong: that finding is another rule's.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from importlib import import_module
from pathlib import Path

from composer.analysis.context import Context, place
from composer.analysis.words import with_short_echoes
from composer.diagnostics import Diagnostic, in_order

Check = Callable[[Context], Iterator[Diagnostic]]


def run_checks(context: Context) -> list[Diagnostic]:
    """Return every finding of every rule, sorted by place.

    What an earlier stage refused is not found fault with again.
    """
    refused = {place(span) for span in context.refused}
    return in_order(
        with_short_echoes(finding)
        for check in all_checks()
        for finding in check(context)
        if place(finding.primary) not in refused
    )


@cache
def all_checks() -> tuple[Check, ...]:
    """Return the ``check`` function of every rule, by the names of their modules."""
    names = sorted(path.stem for path in Path(__file__).parent.glob("[a-z]*.py"))
    modules = (import_module(f"{__name__}.{name}") for name in names)
    return tuple(module.check for module in modules if hasattr(module, "check"))


__all__ = ["Check", "Context", "all_checks", "run_checks"]
