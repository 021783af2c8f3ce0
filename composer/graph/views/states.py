"""The lifecycle machine of managed nodes, with the place each node has in it."""

from __future__ import annotations

from composer.graph.picture import Direction, Edge, Graph, Kind, Line, Vertex
from composer.graph.scene import Scene

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
_MOST_NODES = 24


def build(scene: Scene) -> Graph:
    """Return the state machine; each state lists the nodes that are in it."""
    others = sorted({actor.state for actor in scene.actors} - {*_STATES, ""})
    return Graph(
        title=scene.title,
        view="states",
        direction=Direction.RIGHT,
        vertices=tuple(_state(state, scene) for state in (*_STATES, *others)),
        edges=tuple(
            Edge(
                f"state:{begin} -> state:{end}",
                f"state:{begin}",
                f"state:{end}",
                Line.TRANSITION,
                (name,),
            )
            for begin, name, end in _TRANSITIONS
        ),
    )


def _state(state: str, scene: Scene) -> Vertex:
    actors = [actor for actor in scene.actors if actor.state == state]
    names = [actor.full_name for actor in actors]
    shown = names if len(names) <= _MOST_NODES else names[: _MOST_NODES - 1]
    more = [f"and {len(names) - len(shown)} more"] if len(names) > len(shown) else []
    return Vertex(
        key=f"state:{state}",
        kind=Kind.STATE,
        lines=(state, *shown, *more),
        details=(("nodes", [*names]),),
        wrong=next((actor.wrong for actor in actors if actor.wrong), ""),
    )
