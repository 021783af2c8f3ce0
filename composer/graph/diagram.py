"""The content of a diagram, independent of its format.

Every view turns a scene into a :class:`Graph`; every format turns a Graph into text.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from enum import StrEnum

from composer.base.fast_dataclass import dataclass
from composer.language.tree import Plain


class View(StrEnum):
    """The view of a system."""

    NODES = "nodes"
    CONNECTIONS = "connections"
    LIFECYCLE = "lifecycle"
    DEPLOYMENT = "deployment"
    STATES = "states"
    FRAMES = "frames"


class Format(StrEnum):
    """The format of a diagram."""

    MERMAID = "mermaid"
    SVG = "svg"
    PNG = "png"
    JSON = "json"
    HTML = "html"


#: The formats by the suffix of a file name.
FORMATS_BY_SUFFIX = {
    ".mmd": Format.MERMAID,
    ".mermaid": Format.MERMAID,
    ".svg": Format.SVG,
    ".png": Format.PNG,
    ".json": Format.JSON,
    ".html": Format.HTML,
    ".htm": Format.HTML,
}


#: Facts about a vertex or an edge, in the order they are shown.
Details = tuple[tuple[str, Plain], ...]


class VertexKind(StrEnum):
    """The kind of a vertex, which determines its shape and color."""

    NODE = "node"
    TOPIC = "topic"
    SERVICE = "service"
    ACTION = "action"
    PORT = "port"
    STATE = "state"
    FRAME = "coordinate_frame"


class EdgeKind(StrEnum):
    """The kind of an edge, which determines its stroke."""

    TOPIC = "topic"
    SERVICE = "service"
    ACTION = "action"
    DEPENDENCY = "dependency"
    IMPLIED = "implied"  # a dependency that is not declared
    TRANSITION = "transition"
    TRANSFORM = "transform"  # from a parent frame to its child


class Direction(StrEnum):
    """The main direction of the arrows."""

    RIGHT = "LR"
    DOWN = "TB"


class Mark(StrEnum):
    """How a part with a problem is drawn."""

    WRONG = "wrong"
    DOUBTFUL = "doubtful"


@dataclass(frozen=True, slots=True)
class Problem:
    """A diagnostic that marks a part of a diagram; a warning makes it doubtful."""

    text: str
    mark: Mark = Mark.WRONG


def worst(problems: Iterable[Problem | None]) -> Problem | None:
    """Return the first problem that makes a part wrong, else the first one, if there is any."""
    some = [problem for problem in problems if problem is not None]
    return min(some, key=lambda problem: problem.mark is not Mark.WRONG, default=None)


@dataclass(frozen=True, slots=True)
class Vertex:
    """A shape with a label. ``key`` is unique in its graph; ``lines`` are the lines of the label.

    ``cluster`` is the key of its cluster, or empty; ``namespace`` is the namespace of its name.
    ``problem`` marks it.
    """

    key: str
    kind: VertexKind
    lines: tuple[str, ...]
    cluster: str = ""
    namespace: str = "/"
    details: Details = ()
    problem: Problem | None = None


@dataclass(frozen=True, slots=True)
class Edge:
    """An arrow between two vertices. ``key`` is unique in its graph."""

    key: str
    source: str
    target: str
    kind: EdgeKind
    lines: tuple[str, ...] = ()
    details: Details = ()
    problem: Problem | None = None


@dataclass(frozen=True, slots=True)
class Cluster:
    """A frame around vertices and other clusters; ``parent`` is empty for the outermost.

    A ``block`` is a node drawn with its ports, which are its only contents.
    """

    key: str
    label: str
    parent: str = ""
    details: Details = ()
    block: bool = False
    namespace: str = "/"
    problem: Problem | None = None


@dataclass(frozen=True, slots=True)
class Graph:
    """One diagram. Parents come before their children in ``clusters``; all orders are stable."""

    title: str
    view: str
    direction: Direction
    vertices: tuple[Vertex, ...]
    edges: tuple[Edge, ...]
    clusters: tuple[Cluster, ...] = ()

    @property
    def blocks(self) -> tuple[Cluster, ...]:
        """The nodes that are drawn with their ports."""
        return tuple(cluster for cluster in self.clusters if cluster.block)

    @property
    def things(self) -> tuple[Cluster | Vertex | Edge, ...]:
        """Everything with details: blocks, vertices and edges."""
        return (*self.blocks, *self.vertices, *self.edges)


class Namespaces:
    """The namespaces of nodes. A namespace with only one child and no nodes is not drawn."""

    def __init__(self, namespaces: Iterable[str]) -> None:
        used = set(namespaces) - {"/"}
        self._drawn = {name for name in with_ancestors(used) if name in used or _forks(name, used)}

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


def parent_of(name: str) -> str:
    """Return the namespace of a full name."""
    return name.rpartition("/")[0] or "/"


def with_ancestors(namespaces: Iterable[str]) -> set[str]:
    """Return the namespaces and those around them, without the root."""
    ancestors: set[str] = set()
    for namespace in namespaces:
        name = namespace
        while name != "/":
            ancestors.add(name)
            name = parent_of(name)
    return ancestors


def _forks(name: str, used: set[str]) -> bool:
    prefix = f"{name}/"
    children = {
        other.removeprefix(prefix).split("/")[0] for other in used if other.startswith(prefix)
    }
    return len(children) > 1


def natural_order(name: str) -> list[tuple[int, str]]:
    """Return a key for sorting that puts area2 before area10."""
    return [
        (int(item), "") if item.isdigit() else (-1, item) for item in re.split(r"([0-9]+)", name)
    ]
