"""Merge one map over another, and apply the ``overrides`` of an include."""

from __future__ import annotations

from collections.abc import Iterator

from composer.assembly.rules import UNKNOWN_OVERRIDE
from composer.diagnostics import Diagnostic, shown, suggestion
from composer.source import SourceFile
from composer.tree import Entry, Mapping, Scalar, Tree

PARAMETERS = "parameters"
#: Keys that exclude each other: one replaces the other.
_ALTERNATIVES = frozenset({"period_ms", "rate_hz"})


def merge_maps(base: Mapping, upper: Mapping) -> Mapping:
    """Return ``base`` with the entries of ``upper`` merged into it.

    Maps are merged key by key, all other values are replaced. A plain value for a declared
    parameter replaces its default. Every key and value keeps its location.
    """
    changes = {entry.name: entry for entry in upper}
    replaced = _ALTERNATIVES if changes.keys() & _ALTERNATIVES else frozenset()
    kept = []
    for entry in base:
        change = changes.pop(entry.name, None)
        if change is not None:
            kept.append(_merged_entry(entry, change))
        elif entry.name not in replaced:
            kept.append(entry)
    return Mapping((*kept, *changes.values()), base.span)


def _merged_entry(base: Entry, upper: Entry) -> Entry:
    if not isinstance(base.value, Mapping) or not isinstance(upper.value, Mapping):
        return upper
    if base.name == PARAMETERS:
        return Entry(base.key, merge_maps(base.value, _as_declared(base.value, upper.value)))
    return Entry(base.key, merge_maps(base.value, upper.value))


def _as_declared(base: Mapping, upper: Mapping) -> Mapping:
    """Return ``upper`` with plain values as defaults of the parameters that ``base`` declares."""
    declared = {entry.name for entry in base if isinstance(entry.value, Mapping)}
    return Mapping(
        tuple(
            Entry(entry.key, _default(entry.value))
            if entry.name in declared and not isinstance(entry.value, Mapping)
            else entry
            for entry in upper
        ),
        upper.span,
    )


def _default(value: Tree) -> Mapping:
    return Mapping((Entry(Scalar("default", value.span, verbatim=False), value),), value.span)


_SECTIONS = {
    "nodes": "node",
    "qos_profiles": "QoS profile",
    "executors": "executor",
    "chains": "chain",
}


def apply_overrides(
    tree: Mapping, overrides: Mapping, source: SourceFile, diagnostics: list[Diagnostic]
) -> Mapping:
    """Return a system with ``overrides`` merged into its entries.

    Names are those of the included file ``source``; unknown names are reported and skipped.
    """
    known: list[Entry] = []
    for section in overrides:
        of_system = tree.get(section.name)
        if section.name not in _SECTIONS or not isinstance(section.value, Mapping):
            continue
        names = [entry.name for entry in of_system] if isinstance(of_system, Mapping) else []
        diagnostics.extend(_unknown(section, names, source))
        kept = tuple(
            entry
            for entry in section.value
            if entry.name in names and isinstance(entry.value, Mapping)
        )
        if kept:
            known.append(Entry(section.key, Mapping(kept, section.value.span)))
    return merge_maps(tree, Mapping(tuple(known), overrides.span)) if known else tree


def _unknown(section: Entry, names: list[str], source: SourceFile) -> Iterator[Diagnostic]:
    for entry in section.value if isinstance(section.value, Mapping) else ():
        if entry.name not in names:
            what = _SECTIONS[section.name]
            message = f"'{source.path}' has no {what} '{shown(entry.name)}'"
            hint = suggestion(entry.name, names)
            yield Diagnostic(UNKNOWN_OVERRIDE, message, entry.key.span, hint=hint)
