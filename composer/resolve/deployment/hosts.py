"""Read the hosts of a system."""

from __future__ import annotations

from composer.model import Host
from composer.resolve.tree_values import entries, environment, integer, key, text, texts
from composer.tree import Entry, Tree
from composer.tree import Mapping as MappingTree


def read_hosts(tree: Tree | None) -> tuple[Host, ...]:
    """Return the hosts."""
    return tuple(_host(entry) for entry in entries(tree))


def _host(entry: Entry) -> Host:
    tree = entry.value if isinstance(entry.value, MappingTree) else MappingTree((), entry.key.span)
    port = integer(tree.get("port"))
    setup = tree.get("setup")
    return Host(
        name=key(entry),
        span=entry.key.span,
        address=text(tree.get("address")) or key(entry),
        port=None if port is None else port.value,
        user=text(tree.get("user")),
        workspace=text(tree.get("workspace")),
        python=_plain(tree.get("python")),
        setup=() if setup is None else tuple(item.value for item in texts(setup)),
        environment=environment(tree.get("environment")),
        identity_file=_plain(tree.get("identity_file")),
        known_hosts=_plain(tree.get("known_hosts")),
    )


def _plain(tree: Tree | None) -> str | None:
    found = text(tree)
    return None if found is None else found.value
