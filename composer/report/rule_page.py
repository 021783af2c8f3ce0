"""The documentation of the rules: docs/rules.md, and text for ``compose rule``."""

from __future__ import annotations

import re
from collections.abc import Iterable
from itertools import groupby

import composer.document
import composer.expand
import composer.resolve
import composer.rules
import composer.schema
from composer.diagnostics import Rule, registered_rules

#: The topic of each code band, by the first digit.
BANDS = {
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
This page is generated from the rules (`make generate`), and every example is tested.

To ignore a warning or an info, add a comment on the same line, or on a line of its own before it:
`# compose: ignore[publisher-without-subscription]`. Errors cannot be ignored.
"""


def all_rules() -> tuple[Rule, ...]:
    """Return all rules, sorted by code. Imports every module that registers rules."""
    composer.rules.all_checks()
    return tuple(registered_rules())


def find_rule(text: str, rules: Iterable[Rule]) -> Rule | None:
    """Return the rule with the code or name ``text``, or None."""
    name = text.casefold()
    return next((rule for rule in rules if name in {rule.code.casefold(), rule.name}), None)


def explain(rule: Rule) -> str:
    """Return the documentation of a rule, for a terminal."""
    return "\n".join(
        [
            f"{rule.code} {rule.name} ({rule.severity.value})",
            "",
            rule.summary,
            rule.why,
            "",
            "Example:",
            "",
            _indented(rule.bad),
            "",
            "Use instead:",
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
    return "\n".join(["| code | name | severity | summary |", "|---|---|---|---|", *rows, ""])


def _section(rule: Rule) -> str:
    return "\n".join(
        [
            f"### {rule.code} {rule.name}",
            "",
            f"*{rule.severity.value}* - {rule.summary} {rule.why}",
            "",
            _example(rule.bad),
            "Use instead:",
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


_HEADER = re.compile(r"# file: (?P<name>[A-Za-z0-9_./-]+)")
_MARKER = re.compile(r"(?P<kind>system|node): *(?P<name>\w+)")


def files_of(example: str) -> dict[str, str]:
    """Return the files of an example by name, starting with the one to validate.

    An example has one file, or several with a line ``# file: name`` before each. Returns an empty
    dict if the example is not a YAML file, such as a directory listing.
    """
    files: dict[str, list[str]] = {}
    current: list[str] | None = None
    for line in example.splitlines(keepends=True):
        header = _HEADER.fullmatch(line.strip())
        if header is not None:
            current = files.setdefault(header["name"], [])
        elif current is None:
            name = _name(line)
            if name is None:
                return {}
            current = files.setdefault(name, [line])
        else:
            current.append(line)
    return {name: "".join(lines) for name, lines in files.items()}


def _name(first_line: str) -> str | None:
    """Return a name for a file that starts with ``first_line``, or None."""
    marker = _MARKER.match(first_line)
    if marker is None:
        return None
    return f"{marker['name']}.yaml" if marker["kind"] == "node" else "system.yaml"
