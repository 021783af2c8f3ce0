"""What a diagram shows, before anything decides how it looks: the one value renderers read.

Every view (``views/``) turns a system into a :class:`Graph`; every renderer (``mermaid``, ``dot``,
``json``, ``svg``) turns a Graph into text. Neither knows of the other.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from composer.tree import Plain

#: Facts about a vertex or an edge, in the order they are shown.
Details = tuple[tuple[str, Plain], ...]


class Kind(StrEnum):
    """What a vertex stands for; renderers give each its own shape and colour."""

    NODE = "node"
    TOPIC = "topic"
    SERVICE = "service"
    ACTION = "action"
    PORT = "port"
    STATE = "state"


class Line(StrEnum):
    """What an edge stands for; renderers give each its own stroke."""

    TOPIC = "topic"
    SERVICE = "service"
    ACTION = "action"
    DEPENDENCY = "dependency"
    IMPLIED = "implied"  # a dependency that nobody wrote down
    TRANSITION = "transition"


class Direction(StrEnum):
    """Where the arrows of a diagram mostly point."""

    RIGHT = "LR"
    DOWN = "TB"


@dataclass(frozen=True, slots=True)
class Vertex:
    """Something drawn as a shape. ``key`` is unique in its graph; ``lines`` is the label.

    ``cluster`` is the key of the cluster it stands in, empty for none; ``namespace`` is where it
    belongs by its name. ``wrong`` is the diagnostic that colours it, empty for none.
    """

    key: str
    kind: Kind
    lines: tuple[str, ...]
    cluster: str = ""
    namespace: str = "/"
    details: Details = ()
    wrong: str = ""


@dataclass(frozen=True, slots=True)
class Edge:
    """An arrow between two vertices. ``key`` is unique in its graph."""

    key: str
    source: str
    target: str
    kind: Line
    lines: tuple[str, ...] = ()
    details: Details = ()
    wrong: str = ""


@dataclass(frozen=True, slots=True)
class Cluster:
    """A frame around vertices and other clusters; ``parent`` is empty for the outermost.

    A ``block`` is a node that shows its ports: they are all it holds, and it stays in one piece.
    """

    key: str
    label: str
    parent: str = ""
    details: Details = ()
    block: bool = False
    namespace: str = "/"
    wrong: str = ""


@dataclass(frozen=True, slots=True)
class Graph:
    """One diagram. Parents come before their children in ``clusters``; all orders are stable."""

    title: str
    view: str
    direction: Direction
    vertices: tuple[Vertex, ...]
    edges: tuple[Edge, ...]
    clusters: tuple[Cluster, ...] = ()
