"""One map laid over another: what both say is said by the upper one, deep down."""

from __future__ import annotations

from composer.tree import Entry, Mapping, Scalar, Tree

PARAMETERS = "parameters"
#: Keys that say the same in two ways: one takes the place of the other.
_ALTERNATIVES = frozenset({"period_ms", "rate_hz"})


def merged(base: Mapping, upper: Mapping) -> Mapping:
    """Return ``base`` with what ``upper`` says in it.

    Maps are merged key by key, everything else is replaced. A plain value for a declared parameter
    is its default. Every key and value keeps its place.
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
        return Entry(base.key, merged(base.value, _as_declared(base.value, upper.value)))
    return Entry(base.key, merged(base.value, upper.value))


def _as_declared(base: Mapping, upper: Mapping) -> Mapping:
    """Return parameters with plain values as defaults of those that ``base`` declares."""
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
