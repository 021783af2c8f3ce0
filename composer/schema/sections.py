"""Misspelled sections of a file: reported once, and read under the name that was meant.

Otherwise every use of what a misspelled section declares would be reported as well.
"""

from __future__ import annotations

from functools import cache

from composer.diagnostics import Diagnostic, nearest, shown
from composer.schema import rules, schema
from composer.schema.common_mistakes import intended_key
from composer.tree import Entry, Mapping, Scalar


def with_intended_sections(tree: Mapping, kind: str) -> tuple[Mapping, list[Diagnostic]]:
    """Return a file of ``kind`` with its sections under their right names, and the diagnostics.

    Unknown keys that resemble no section stay as they are: ``check_schema`` reports them.
    """
    title, sections = _sections(kind)
    if all(entry.name in sections for entry in tree):
        return tree, []
    missing = [name for name in sections if tree.entry(name) is None]
    diagnostics = []
    entries = []
    for entry in tree:
        meant = nearest(entry.name, missing) if entry.name not in sections else None
        if meant is None or meant != intended_key(entry.name, missing):
            entries.append(entry)
            continue
        missing.remove(meant)
        message = f"'{shown(entry.name)}' is not a key of a {title}"
        hint = f"did you mean '{meant}'?"
        diagnostics.append(Diagnostic(rules.UNKNOWN_KEY, message, entry.key.span, hint=hint))
        entries.append(Entry(Scalar(meant, entry.key.span, verbatim=False), entry.value))
    return Mapping(tuple(entries), tree.span), diagnostics


@cache
def _sections(kind: str) -> tuple[str, tuple[str, ...]]:
    """Return the title of a kind of file, and its sections."""
    content = schema(kind)
    return content["title"], tuple(content["properties"])
