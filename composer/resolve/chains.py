"""Chains: the ways that data takes, and how long it may take."""

from __future__ import annotations

from composer.model import Chain, Endpoint
from composer.resolve.reading import entries, key, number, texts
from composer.tree import Entry, Mapping, Tree


def chains(tree: Tree | None) -> tuple[Chain, ...]:
    """Return what is declared under ``chains``; one without latency or way is left out."""
    found = (_chain(entry) for entry in entries(tree))
    return tuple(chain for chain in found if chain is not None)


def _chain(entry: Entry) -> Chain | None:
    tree = entry.value if isinstance(entry.value, Mapping) else Mapping((), entry.key.span)
    latency_ms = number(tree.get("latency_ms"))
    through = tuple(Endpoint(name) for name in texts(tree.get("through")))
    if latency_ms is None or not through:
        return None
    return Chain(key(entry), through, latency_ms, entry.key.span)
