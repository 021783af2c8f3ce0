"""Merge one map over another, apply the ``overrides`` of an include, and join parts of a system."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from composer.base.diagnostics import Diagnostic, Label, shown, suggestion
from composer.base.fast_dataclass import dataclass
from composer.base.source import SourceFile, Span
from composer.language.rules import DUPLICATE_NAME
from composer.language.tree import (
    Entry,
    LeftOut,
    Mapping,
    Scalar,
    ScalarValue,
    Sequence,
    Tree,
    changed_at,
    entries,
    is_opaque,
    plain,
)
from composer.model.assembly.limits import INVALID_INCLUDE, UNKNOWN_OVERRIDE

PARAMETERS = "parameters"
#: Keys that exclude each other: one replaces the other.
_ALTERNATIVES = frozenset({"period_ms", "rate_hz"})
#: What a node loses that an override gives another type: its implementation, and values for it.
_OF_TYPE = frozenset(
    {"behavior", "class", "executable", "component", "external", "container", "arguments"}
    | {"parameters", "variables", "only_declared", "state"}
)
#: Sections whose entries an include can override.
_OVERRIDABLE = ("nodes", "qos_profiles", "executors", "chains")
INCLUDE = "include"
#: Sections that are joined, with the term for their entries.
_MAPS = {
    "qos_profiles": "QoS profile",
    "executors": "executor",
    "processes": "process",
    "hosts": "host",
    "nodes": "node",
    "chains": "chain",
}
_LISTS = ("parameter_files", "connections")
_SEVERAL = 2
#: Settings of a whole system, with their defaults.
_SYSTEM_SETTINGS: dict[tuple[str, ...], ScalarValue] = {
    ("lifecycle", "implied_dependencies"): True,
    ("delivery",): "auto",
    ("discovery", "kind"): "multicast",
}


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


def apply_overrides(
    tree: Mapping, overrides: Mapping, source: SourceFile, diagnostics: list[Diagnostic]
) -> Mapping:
    """Return a system with ``overrides`` merged into its entries.

    Names are those of the included file ``source``; unknown names are reported and skipped.
    """
    known: list[Entry] = []
    for section in overrides:
        if section.name not in _OVERRIDABLE or not isinstance(section.value, Mapping):
            continue
        names = [entry.name for entry in entries(tree.get(section.name))]
        diagnostics.extend(_unknown(section, names, source))
        kept = tuple(
            entry
            for entry in section.value
            if entry.name in names and isinstance(entry.value, Mapping)
        )
        if kept:
            known.append(Entry(section.key, Mapping(kept, section.value.span)))
        for entry in kept if section.name == "nodes" else ():
            if any(change.name == "type" for change in entries(entry.value)):
                tree = changed_at(tree, ("nodes", entry.name), _without_type)
    return merge_maps(tree, Mapping(tuple(known), overrides.span)) if known else tree


def _without_type(node: Tree) -> Tree:
    """Return a node without what belongs to its type."""
    if not isinstance(node, Mapping):
        return node
    kept = (entry for entry in node if entry.name not in _OF_TYPE)
    return Mapping(tuple(kept), node.span)


def _unknown(section: Entry, names: list[str], source: SourceFile) -> Iterator[Diagnostic]:
    for entry in entries(section.value):
        if entry.name not in names:
            what = _MAPS[section.name]
            message = f"'{source.path}' has no {what} '{shown(entry.name)}'"
            hint = suggestion(entry.name, names)
            yield Diagnostic(UNKNOWN_OVERRIDE, message, entry.key.span, hint=hint)


@dataclass(frozen=True, slots=True)
class Part:
    """A merged file, the place that decides the names of its nodes, and what it leaves out."""

    tree: Mapping
    span: Span
    left_out: tuple[LeftOut, ...] = ()


def join_parts(own: Mapping, parts: Iterable[Part], diagnostics: list[Diagnostic]) -> Mapping:
    """Return ``own`` with the entries of ``parts`` before its own.

    Of two entries with one name the first is kept, and a diagnostic is added.
    """
    all_parts = [*_without_repeats(parts, diagnostics), Part(own, own.span)]
    if len(all_parts) == 1 and own.entry(INCLUDE) is None:
        return own
    sections = {
        **{name: _joined_maps(name, all_parts, diagnostics) for name in _MAPS},
        **{name: _joined_lists(name, all_parts) for name in _LISTS},
    }
    diagnostics.extend(_system_conflicts(own, all_parts[:-1]))
    kept = [sections.pop(entry.name, None) or entry for entry in own if entry.name != INCLUDE]
    added = [entry for entry in sections.values() if entry is not None]
    return Mapping((*kept, *added), own.span)


def _without_repeats(parts: Iterable[Part], diagnostics: list[Diagnostic]) -> Iterator[Part]:
    """Yield the parts, without repeated files whose nodes have the same names."""
    known: dict[tuple[str, str], Part] = {}
    for part in parts:
        named = [entry for entry in entries(part.tree.get("nodes")) if not is_opaque(entry.name)]
        names = [(entry.name, str(entry.key.span)) for entry in named]
        earlier = next((known[name] for name in names if name in known), None)
        if earlier is None:
            known.update(dict.fromkeys(names, part))
            yield part
            continue
        label = Label(earlier.span, "included here too")
        message = "this file is included twice with the same node names"
        hint = "give each include its own 'prefix'"
        related = (label,) if str(earlier.span) != str(part.span) else ()
        diagnostics.append(Diagnostic(DUPLICATE_NAME, message, part.span, related, hint))


def _joined_maps(name: str, all_parts: list[Part], diagnostics: list[Diagnostic]) -> Entry | None:
    sections = _sections(name, all_parts)
    if not all(isinstance(section.value, Mapping) for section in sections):
        return sections[-1]
    if len(sections) < _SEVERAL:
        return next(iter(sections), None)
    found: dict[str, Entry] = {}
    for part in all_parts:
        for entry in entries(part.tree.get(name)):
            earlier = found.setdefault(entry.name, entry)
            if earlier is not entry:
                diagnostics.extend(_conflict(name, entry, earlier))
    return Entry(sections[-1].key, Mapping(tuple(found.values()), sections[-1].value.span))


def _joined_lists(name: str, all_parts: list[Part]) -> Entry | None:
    sections = _sections(name, all_parts)
    if len(sections) < _SEVERAL:
        return next(iter(sections), None)
    items = [item for section in sections for item in _items(section.value)]
    return Entry(sections[-1].key, Sequence(tuple(items), sections[-1].value.span))


def _sections(name: str, all_parts: list[Part]) -> list[Entry]:
    found = (part.tree.entry(name) for part in all_parts)
    return [entry for entry in found if entry is not None]


def _items(tree: Tree) -> Iterator[Tree]:
    yield from tree.items if isinstance(tree, Sequence) else (tree,)


def _conflict(section: str, entry: Entry, earlier: Entry) -> Iterator[Diagnostic]:
    name = shown(entry.name)
    label = Label(earlier.key.span, "the other one")
    if section == "nodes" and "${" in name:
        return  # what should repeat the nodes is wrong
    if section == "nodes":
        message = f"two nodes are called '{name}'"
        hint = "give an include a 'prefix'"
        yield Diagnostic(DUPLICATE_NAME, message, entry.key.span, (label,), hint)
    elif section == "chains" or plain(entry.value) != plain(earlier.value):
        message = f"there are two different {_MAPS[section]}s '{name}'"
        hint = "make them equal with the 'overrides' of the include, or rename one"
        yield Diagnostic(INVALID_INCLUDE, message, entry.key.span, (label,), hint)


def _system_conflicts(own: Mapping, parts: list[Part]) -> Iterator[Diagnostic]:
    """Yield a diagnostic for each setting of a part that differs from the system's."""
    for part in parts:
        for path, usual in _SYSTEM_SETTINGS.items():
            theirs, ours = _setting(part.tree, path), _setting(own, path)
            if theirs is None or theirs.value == (usual if ours is None else ours.value):
                continue
            message = f"'{path[-1]}' of an included file differs from the value in the system"
            labels = (Label(ours.span, "the system's"),) if ours is not None else ()
            hint = f"set '{'.'.join(path)}' only in the including file"
            yield Diagnostic(INVALID_INCLUDE, message, theirs.span, labels, hint)


def _setting(tree: Mapping, path: tuple[str, ...]) -> Scalar | None:
    found: Tree | None = tree
    for name in path:
        found = found.get(name) if isinstance(found, Mapping) else None
    return found if isinstance(found, Scalar) and "${" not in str(found.value) else None
