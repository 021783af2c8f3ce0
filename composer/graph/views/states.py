"""The lifecycle machine of REP-style managed nodes, with the place each node is brought to."""

from __future__ import annotations

from composer.graph.findings import Findings
from composer.graph.picture import Direction, Edge, Graph, Kind, Line, Vertex
from composer.model import System
from composer.plan import bring_up

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

_REACHED = {"configure": "inactive", "activate": "active"}


def build(system: System, findings: Findings) -> Graph:
    """Return the state machine; each state lists the nodes that the bring-up leaves there."""
    places = _places(system)
    return Graph(
        title=system.name.value,
        view="states",
        direction=Direction.RIGHT,
        vertices=tuple(_state(state, places, system, findings) for state in _STATES),
        edges=tuple(
            Edge(f"state:{begin}", f"state:{end}", Line.TRANSITION, (name,))
            for begin, name, end in _TRANSITIONS
        ),
    )


def _places(system: System) -> dict[str, str]:
    """Return the state that the bring-up takes each node to."""
    places = dict.fromkeys((node.name.value for node in system.nodes), "unconfigured")
    for step in bring_up(system).steps:
        places[step.node] = _REACHED.get(step.transition, places[step.node])
    return places


def _state(state: str, places: dict[str, str], system: System, findings: Findings) -> Vertex:
    nodes = [node for node in system.nodes if places[node.name.value] == state]
    return Vertex(
        key=f"state:{state}",
        kind=Kind.STATE,
        lines=(state, *(node.full_name for node in nodes)),
        details=(("nodes", [node.full_name for node in nodes]),),
        wrong=next(filter(None, map(findings.about_node, nodes)), ""),
    )
