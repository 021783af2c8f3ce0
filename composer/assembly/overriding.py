"""``overrides`` of an include: what is said differently about what the included file has."""

from __future__ import annotations

from collections.abc import Iterator

from composer.assembly.merging import merged
from composer.assembly.rules import UNKNOWN_OVERRIDE
from composer.diagnostics import Diagnostic, shown, suggestion
from composer.source import SourceFile
from composer.tree import Entry, Mapping

_SECTIONS = {
    "nodes": "node",
    "qos_profiles": "QoS profile",
    "executors": "executor",
    "chains": "chain",
}


def overridden(
    tree: Mapping, overrides: Mapping, source: SourceFile, findings: list[Diagnostic]
) -> Mapping:
    """Return a system with what ``overrides`` say of the things that it has.

    Names are those of the included file ``source``. What it does not have is told and left out.
    """
    known: list[Entry] = []
    for section in overrides:
        of_system = tree.get(section.name)
        if section.name not in _SECTIONS or not isinstance(section.value, Mapping):
            continue
        names = [entry.name for entry in of_system] if isinstance(of_system, Mapping) else []
        findings.extend(_unknown(section, names, source))
        kept = tuple(
            entry
            for entry in section.value
            if entry.name in names and isinstance(entry.value, Mapping)
        )
        if kept:
            known.append(Entry(section.key, Mapping(kept, section.value.span)))
    return merged(tree, Mapping(tuple(known), overrides.span)) if known else tree


def _unknown(section: Entry, names: list[str], source: SourceFile) -> Iterator[Diagnostic]:
    for entry in section.value if isinstance(section.value, Mapping) else ():
        if entry.name not in names:
            what = _SECTIONS[section.name]
            message = f"'{source.path}' has no {what} '{shown(entry.name)}'"
            hint = suggestion(entry.name, names)
            yield Diagnostic(UNKNOWN_OVERRIDE, message, entry.key.span, hint=hint)
