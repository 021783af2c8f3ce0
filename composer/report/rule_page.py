"""The catalogue of rules: all that can be wrong, why it matters, and how to do it instead."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import groupby

import composer.document
import composer.expand
import composer.resolve
import composer.rules
import composer.schema
from composer.diagnostics import Rule, registered_rules
from composer.report.samples import files_of

#: What the first digit of a code stands for.
BANDS = {
    "0": "Reading",
    "1": "Schema",
    "2": "Names and references",
    "3": "Types, QoS and wiring",
    "4": "Lifecycle, timers, parameters and behaviours",
    "5": "Style",
    "9": "Internal",
}

_INTRODUCTION = """\
# Rules

What `compose validate` finds. Errors keep a system from running; warnings and infos do not.
This page is made from the rules themselves by `python tools/write_rules.py`; a test runs each
example.

A comment on the line of a finding, or on a line of its own before it, silences a warning or an info
there: `# compose: ignore[unheard-publisher]`. Errors are not silenced.
"""


def all_rules() -> tuple[Rule, ...]:
    """Return every rule of the pipeline, by code. Imports the modules that have them."""
    composer.rules.all_checks()
    return tuple(registered_rules())


def find_rule(text: str, rules: Iterable[Rule]) -> Rule | None:
    """Return the rule with the code or name ``text``, or None."""
    wanted = text.casefold()
    return next((rule for rule in rules if wanted in {rule.code.casefold(), rule.name}), None)


def explain(rule: Rule) -> str:
    """Return all that is known of a rule, for a terminal."""
    return "\n".join(
        [
            f"{rule.code} {rule.name} ({rule.severity.value})",
            "",
            rule.summary,
            rule.why,
            "",
            "Instead of",
            "",
            _indented(rule.bad),
            "",
            "write",
            "",
            _indented(rule.good),
            "",
        ]
    )


def page(rules: Iterable[Rule]) -> str:
    """Return the page of all rules, in Markdown."""
    ordered = sorted(rules, key=lambda rule: rule.code)
    parts = [_INTRODUCTION]
    for band, found in groupby(ordered, key=lambda rule: rule.code[2]):
        group = list(found)
        parts.append(f"## {BANDS[band]}\n")
        parts.append(_table(group))
        parts.extend(_section(rule) for rule in group)
    return "\n".join(parts)


def _table(rules: Iterable[Rule]) -> str:
    rows = [
        f"| [{rule.code}](#{rule.code}-{rule.name}) "
        f"| {rule.name} | {rule.severity.value} | {rule.summary} |".replace("#RC", "#rc")
        for rule in rules
    ]
    return "\n".join(["| code | name | severity | what |", "|---|---|---|---|", *rows, ""])


def _section(rule: Rule) -> str:
    return "\n".join(
        [
            f"### {rule.code} {rule.name}",
            "",
            f"*{rule.severity.value}* - {rule.summary} {rule.why}",
            "",
            _example(rule.bad),
            "Instead:",
            "",
            _example(rule.good),
        ]
    )


def _example(example: str) -> str:
    files = files_of(example)
    if not files:
        return f"```\n{example.rstrip()}\n```\n"
    blocks = []
    for name, text in files.items():
        language = "python" if name.endswith(".py") else "yaml"
        title = f"`{name}`:\n\n" if len(files) > 1 else ""
        blocks.append(f"{title}```{language}\n{text.rstrip()}\n```\n")
    return "\n".join(blocks)


def _indented(text: str) -> str:
    return "\n".join(f"    {line}".rstrip() for line in text.rstrip().splitlines())
