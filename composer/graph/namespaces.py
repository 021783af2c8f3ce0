"""Namespaces as frames: which ones to draw, and the frame of each name."""

from __future__ import annotations

from collections.abc import Iterable

from composer.graph.diagram import Cluster


class Namespaces:
    """The namespaces of nodes. A namespace with only one child and no nodes is not drawn."""

    def __init__(self, namespaces: Iterable[str]) -> None:
        used = set(namespaces) - {"/"}
        self._drawn = {name for name in _with_ancestors(used) if name in used or _forks(name, used)}

    def clusters(self) -> tuple[Cluster, ...]:
        """Return a cluster for each drawn namespace, parents first."""
        return tuple(
            Cluster(name, name, self.around(parent_of(name)), namespace=name)
            for name in sorted(self._drawn)
        )

    def around(self, namespace: str) -> str:
        """Return the innermost drawn namespace that contains ``namespace``, or an empty text."""
        while namespace not in self._drawn:
            if namespace == "/":
                return ""
            namespace = parent_of(namespace)
        return namespace

    def around_name(self, full_name: str) -> str:
        """Return the innermost drawn namespace of the name of a topic, service or action."""
        return self.around(parent_of(full_name))


def parent_of(name: str) -> str:
    """Return the namespace of a full name."""
    return name.rpartition("/")[0] or "/"


def _with_ancestors(names: Iterable[str]) -> set[str]:
    found: set[str] = set()
    for name in names:
        levels = name.strip("/").split("/")
        found.update("/" + "/".join(levels[:depth]) for depth in range(1, len(levels) + 1))
    return found


def _forks(name: str, used: set[str]) -> bool:
    depth = name.count("/") + 1
    children = {
        tuple(other.split("/")[: depth + 1]) for other in used if other.startswith(f"{name}/")
    }
    return len(children) > 1
