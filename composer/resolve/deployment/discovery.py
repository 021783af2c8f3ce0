"""Read the discovery of a system."""

from __future__ import annotations

from composer.model.discovery import DEFAULT_SERVER_PORT, Discovery, DiscoveryKind
from composer.resolve.tree_values import choice, entries, flag, integer, key, texts
from composer.source import Located
from composer.tree import Entry, Mapping, Tree


def read_discovery(entry: Entry | None) -> Discovery | None:
    """Return the discovery; None if it is not set, or has no valid kind."""
    if entry is None or not isinstance(entry.value, Mapping):
        return None
    tree = entry.value
    kind = choice(tree.get("kind"), DiscoveryKind)
    if kind is None:
        return None
    port = integer(tree.get("port"))
    return Discovery(
        kind=kind,
        span=entry.key.span,
        interfaces=_texts(tree.get("interfaces")),
        addresses=_texts(tree.get("address")),
        port=DEFAULT_SERVER_PORT if port is None else port.value,
        start=flag(tree.get("start"), default=False),
        peers=_texts(tree.get("peers")),
        given=tuple(key(item) for item in entries(tree)),
    )


def _texts(tree: Tree | None) -> tuple[Located[str], ...]:
    return () if tree is None else texts(tree)
