"""The rules: their pages in docs/rules, their text for a terminal, and which ones are selected."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable

import composer.language.document
import composer.language.expand
import composer.language.schema
import composer.model.resolve
import composer.rules
from composer.base.diagnostics import Diagnostic, Rule, registered_rules, suggestion
from composer.base.fast_dataclass import dataclass
from composer.base.folders import rules_folder

_PAGE = re.compile(
    r"# .+\n\n\*\w+\* - (?P<summary>.+)\n\n(?P<why>(?:.+\n)+)\n"
    r"(?P<bad>(?s:.+))\nUse instead:\n\n(?P<good>(?s:.+))"
)
_BLOCK = re.compile(r"(?:`(?P<name>.+)`:\n\n)?```\w*\n(?P<text>(?:.*\n)*?)```\n")


def all_rules() -> tuple[Rule, ...]:
    """Return all rules, sorted by code. Imports every module that registers rules."""
    composer.rules.all_checks()
    return tuple(registered_rules())


def find_rule(text: str, rules: Iterable[Rule]) -> Rule | None:
    """Return the rule with the code or name ``text``, or None."""
    name = text.casefold()
    return next((rule for rule in rules if name in {rule.code.casefold(), rule.name}), None)


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
    """Return the diagnostics of the selected rules that are not ignored.

    A rule is given by its code (``RC301``), a code prefix (``RC3``) or its name. If ``select`` is
    empty, all rules are selected. Raises UnknownRule if a text matches none of ``rules``.
    """
    selected, ignored = list(select), list(ignore)
    for text in [*selected, *ignored]:
        if not any(rule.matches(text) for rule in rules):
            names = (name for rule in rules for name in (rule.code, rule.name))
            raise UnknownRule(text, suggestion(text, names, limit=0))
    return [
        diagnostic
        for diagnostic in diagnostics
        if (not selected or any(diagnostic.rule.matches(text) for text in selected))
        and not any(diagnostic.rule.matches(text) for text in ignored)
    ]


@dataclass(frozen=True, slots=True)
class RulePage:
    """What the page of a rule says."""

    summary: str
    why: str
    bad: str
    good: str


def page_of(rule: Rule) -> RulePage:
    """Read the page of a rule. Raises OSError, and ValueError if it has another form."""
    text = (rules_folder() / f"{rule.code}.md").read_text(encoding="utf-8")
    page = _PAGE.fullmatch(text)
    if page is None:
        raise ValueError(f"the page of {rule.code} has no summary, reason or example")
    why = " ".join(page["why"].split())
    return RulePage(page["summary"], why, _example(page["bad"]), _example(page["good"]))


def _example(blocks: str) -> str:
    """Return the code of an example, each of several files under a line with its name."""
    return "".join(
        (f"# file: {block['name']}\n" if block["name"] else "") + block["text"]
        for block in _BLOCK.finditer(blocks)
    )


def explain(rule: Rule) -> str:
    """Return the documentation of a rule, for a terminal."""
    page = page_of(rule)
    return "\n".join(
        [
            f"{rule.code} {rule.name} ({rule.severity.value})",
            "",
            page.summary,
            page.why,
            "",
            "Example:",
            "",
            _indented(page.bad),
            "",
            "Use instead:",
            "",
            _indented(page.good),
            "",
        ]
    )


def _indented(text: str) -> str:
    return "\n".join(f"    {line}".rstrip() for line in text.rstrip().splitlines())
