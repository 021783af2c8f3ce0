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
from composer.diagnostics import Diagnostic, Severity, in_order
from composer.source import Span

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
    return in_order(_without_follow_ups(found, context))


def _without_follow_ups(found: list[Diagnostic], context: Context) -> list[Diagnostic]:
    """Leave out what is only reported because a connection has an error: ports lack its name."""
    wrong = {location(item.primary) for item in found if item.rule.name == "wrong-port-kind"}
    found = [
        item
        for item in found
        if item.rule.name != "port-connected-twice" or location(item.primary) not in wrong
    ]
    causes = [item.primary for item in found if item.rule.name in _CAUSES]
    ends = (
        end.text.span
        for connection in (context.system.connections if causes else ())
        for end in (*connection.sources, *connection.sinks)
    )
    if not any(_covers(end, cause) for end in ends for cause in causes):
        return found
    return [item for item in found if item.rule.name not in _FOLLOW_UPS]


def _covers(whole: Span, part: Span) -> bool:
    is_same_line = (whole.file.path, whole.line) == (part.file.path, part.line)
    return is_same_line and 0 <= part.column - whole.column < whole.length


#: Errors in the ports of a connection.
_CAUSES = frozenset({"unknown-node", "unknown-port", "wrong-port-kind", "port-connected-twice"})
#: What depends on the names that connections give to ports.
_FOLLOW_UPS = frozenset(
    {
        "broken-chain",
        "client-without-server",
        "competing-commands",
        "own-publisher",
        "publisher-without-subscription",
        "subscription-without-publisher",
        "unused-remapping",
    }
)


@cache
def all_checks() -> tuple[Check, ...]:
    """Return the ``check`` function of every rule, sorted by module name."""
    names = sorted(path.stem for path in Path(__file__).parent.glob("[a-z]*.py"))
    modules = (import_module(f"{__name__}.{name}") for name in names)
    return tuple(module.check for module in modules if hasattr(module, "check"))


__all__ = ["Check", "Context", "all_checks", "run_checks"]
