"""Selects diagnostics by the code, code prefix or name of their rule."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from composer.diagnostics import Diagnostic, Rule, nearest


class UnknownRule(Exception):
    """No rule has that code, code prefix or name; ``hint`` suggests a similar one."""

    def __init__(self, text: str, hint: str | None) -> None:
        super().__init__(f"no rule is named '{text}'")
        self.hint = hint


def select_diagnostics(
    diagnostics: Iterable[Diagnostic],
    rules: Collection[Rule],
    select: Iterable[str],
    ignore: Iterable[str],
) -> list[Diagnostic]:
    """Return the diagnostics of the selected rules, without those of the ignored rules.

    A rule is given by its code (``RC301``), a code prefix (``RC3``) or its name. If ``select`` is
    empty, all rules are selected. Raises UnknownRule if a text matches none of ``rules``.
    """
    selected, ignored = list(select), list(ignore)
    for text in [*selected, *ignored]:
        if not any(rule.matches(text) for rule in rules):
            raise UnknownRule(text, _hint(text, rules))
    return [
        diagnostic
        for diagnostic in diagnostics
        if (not selected or any(diagnostic.rule.matches(text) for text in selected))
        and not any(diagnostic.rule.matches(text) for text in ignored)
    ]


def _hint(text: str, rules: Iterable[Rule]) -> str | None:
    close = nearest(text, [name for rule in rules for name in (rule.code, rule.name)])
    return None if close is None else f"did you mean '{close}'?"
