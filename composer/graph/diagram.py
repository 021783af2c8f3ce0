"""The content of a diagram, independent of its format.

Every view (``views/``) turns a system into a :class:`Graph`; every renderer (``mermaid``, ``dot``,
``json``, ``svg``) turns a Graph into text.
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum

from composer.fast_dataclass import dataclass
from composer.tree import Plain

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
