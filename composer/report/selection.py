"""Which findings are asked for: rules by code, by band or by name."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from composer.diagnostics import Diagnostic, Rule, nearest


class UnknownRule(Exception):
    """No rule has that code or name, and none is in that band; ``hint`` says what is close."""

    def __init__(self, text: str, hint: str | None) -> None:
        super().__init__(f"no rule is called '{text}'")
        self.hint = hint


def chosen(
    diagnostics: Iterable[Diagnostic],
    rules: Collection[Rule],
    select: Iterable[str],
    ignore: Iterable[str],
) -> list[Diagnostic]:
    """Return the findings of the selected rules (all, where none is) but for the ignored ones.

    A text is a code (``RC301``), the beginning of codes (``RC3``) or a name. Raises UnknownRule
    when it is none of one of ``rules``.
    """
    wanted, unwanted = list(select), list(ignore)
    for text in [*wanted, *unwanted]:
        if not any(rule.matches(text) for rule in rules):
            raise UnknownRule(text, _close(text, rules))
    return [
        diagnostic
        for diagnostic in diagnostics
        if (not wanted or any(diagnostic.rule.matches(text) for text in wanted))
        and not any(diagnostic.rule.matches(text) for text in unwanted)
    ]


def _close(text: str, rules: Iterable[Rule]) -> str | None:
    close = nearest(text, [name for rule in rules for name in (rule.code, rule.name)])
    return None if close is None else f"did you mean '{close}'?"
