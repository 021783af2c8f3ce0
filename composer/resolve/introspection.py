"""What nodes offer to tools: what each says itself, over its system, over its type."""

from __future__ import annotations

from dataclasses import fields

from composer.model import Introspection
from composer.resolve.reading import entries, flag
from composer.tree import Tree


def introspection(*layers: Tree | None) -> Introspection:
    """Return what the ``introspection`` keys say together; a later layer goes before an earlier."""
    said = {
        entry.name: flag(entry.value, default=True) for layer in layers for entry in entries(layer)
    }
    known = {field.name for field in fields(Introspection)}
    return Introspection(**{name: value for name, value in said.items() if name in known})
