"""The lifecycle machine of managed nodes, with the place each node has in it."""

from __future__ import annotations

from composer.graph.diagram import Direction, Edge, EdgeKind, Graph, Vertex, VertexKind, worst
from composer.graph.scenes.scene import Scene

_STATES = ("unconfigured", "inactive", "active", "finalized")

#: (from, transition, to): design.ros2.org/articles/node_lifecycle.html, primary states only.
_TRANSITIONS = (
    ("unconfigured", "configure", "inactive"),
    ("inactive", "activate", "active"),
    ("active", "deactivate", "inactive"),
    ("inactive", "cleanup", "unconfigured"),
    ("unconfigured", "shutdown", "finalized"),
    ("inactive", "shutdown", "finalized"),
    ("active", "shutdown", "finalized"),
)

#: A state with more nodes than these says how many more there are.
_MAX_NODES = 24


def build(scene: Scene) -> Graph:
    """Return the state machine; each state lists the nodes that are in it."""
    others = sorted({node.state for node in scene.nodes} - {*_STATES, ""})
    return Graph(
        title=scene.title,
        view="states",
        direction=Direction.RIGHT,
        vertices=tuple(_state(state, scene) for state in (*_STATES, *others)),
        edges=tuple(
            Edge(
                f"state:{begin} -> state:{port}",
                f"state:{begin}",
                f"state:{port}",
                EdgeKind.TRANSITION,
                (name,),
            )
            for begin, name, port in _TRANSITIONS
        ),
    )


def _state(state: str, scene: Scene) -> Vertex:
    nodes = [node for node in scene.nodes if node.state == state]
    names = [node.full_name for node in nodes]
    shown = names if len(names) <= _MAX_NODES else names[: _MAX_NODES - 1]
    more = [f"and {len(names) - len(shown)} more"] if len(names) > len(shown) else []
    return Vertex(
        key=f"state:{state}",
        kind=VertexKind.STATE,
        lines=(state, *shown, *more),
        details=(("nodes", [*names]),),
        problem=worst(node.problem for node in nodes),
    )
