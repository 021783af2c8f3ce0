"""Write docs/rules.md, the list of the rules."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import groupby
from pathlib import Path

from composer.base.diagnostics import Rule
from composer.report.rules import all_rules, page_of

PAGE = Path(__file__).parents[1] / "docs" / "rules.md"

#: The topic of each code band, by the first digit.
_BANDS = {
    "0": "Reading",
    "1": "Schema",
    "2": "Names and references",
    "3": "Types, QoS and wiring",
    "4": "Lifecycle, timers, parameters and behaviors",
    "5": "Style and transforms",
    "9": "Internal",
}

_INTRODUCTION = """\
# Rules

The rules of `compose validate`. A system with errors does not run; one with warnings or infos does.
Each rule has a page with the reason, a wrong example and a right one. Every example is tested.

To ignore a warning or an info, add a comment on the same line, or on a line of its own before it:
`# compose: ignore[publisher-without-subscription]`. Errors cannot be ignored.
"""


def page(rules: Iterable[Rule]) -> str:
    """Return the list of all rules, in Markdown."""
    ordered = sorted(rules, key=lambda rule: rule.code)
    parts = [_INTRODUCTION]
    for band, group in groupby(ordered, key=lambda rule: rule.code[2]):
        rows = [
            f"| [{rule.code}](rules/{rule.code}.md) | {rule.name} | {rule.severity.value} "
            f"| {page_of(rule).summary} |"
            for rule in group
        ]
        table = ["| code | name | severity | summary |", "|---|---|---|---|", *rows, ""]
        parts += [f"## {_BANDS[band]}\n", *table]
    return "\n".join(parts)


def main() -> None:
    """Write the page."""
    PAGE.write_text(page(all_rules()), encoding="utf-8")


if __name__ == "__main__":
    main()
