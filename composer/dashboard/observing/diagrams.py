"""Diagrams as the page shows them: those of ``compose graph``, with room for states and rates."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable
from dataclasses import replace
from typing import Any

from composer.graph.diagram import Cluster, Direction, Edge, Graph, Vertex
from composer.graph.formats.svg import contents, markers
from composer.graph.layout import Size, arrange_for_pages
from composer.graph.scene import Scene
from composer.graph.views import View, build_graph, live_scene_of
from composer.model import PortKind
from composer.plan.drift import Snapshot, is_manager

#: Stand where the page writes the state of a node and the rate of a topic, as the longest usual
#: ones: what is measured must not change the layout.
STATE_PLACEHOLDER = "unconfigured"
RATE_PLACEHOLDER_HZ = 1111.0
#: Stands where the page writes the process of an executor.
PROCESS_PLACEHOLDER = "pid 4194304 · 10 restarts"
_NODE = "node:"
#: Those of the last views are kept.
_MAX_DIAGRAMS = 4
#: Views without a direction of their own.
_TURNED = (View.NODES, View.CONNECTIONS, View.DEPLOYMENT)


def live_scene(snapshot: Snapshot) -> Scene:
    """Return the scene of a ROS graph; positions do not depend on states and rates.

    The managers of systems are left out: the page shows what they report.
    """
    nodes = tuple(
        replace(node, state=STATE_PLACEHOLDER if node.state != "" else "")
        for node in snapshot.nodes
        if not is_manager(node.full_name, node.endpoints)
    )
    rates_hz = {
        endpoint.name: RATE_PLACEHOLDER_HZ
        for node in nodes
        for endpoint in node.endpoints
        if endpoint.kind is PortKind.PUBLISHER
    }
    return live_scene_of(replace(snapshot, nodes=nodes), rates_hz)


class Diagram:
    """A diagram that is laid out, and what is known about everything in it, by key."""

    def __init__(self, scene: Scene, view: View) -> None:
        graph = build_graph(_without_qos(scene) if view is View.NODES else scene, view)
        if view is View.DEPLOYMENT:
            labeled = (
                replace(cluster, label=f"{cluster.label} · {PROCESS_PLACEHOLDER}")
                for cluster in graph.clusters
            )
            graph = replace(graph, clusters=tuple(labeled))
        directions = tuple(Direction) if view in _TURNED else (graph.direction,)
        self._graph = graph
        self._layout_on = arrange_for_pages(graph, directions)
        self._facts = {thing.key: _facts(thing) for thing in graph.things}
        self._executors = _nodes_by_executor(graph) if view is View.DEPLOYMENT else {}

    def on(self, page: Size) -> dict[str, Any]:
        """Return an SVG fragment and the facts; ``page`` is the size of its place in pixels.

        All texts in the fragment are escaped.
        """
        graph, layout = self._graph, self._layout_on(page)
        return {
            "title": graph.title,
            "view": graph.view,
            "width": layout.size.width,
            "height": layout.size.height,
            "svg": "\n".join((markers(), *contents(graph, layout))),
            "things": self._facts,
            "executors": self._executors,
        }


def _without_qos(scene: Scene) -> Scene:
    """Leave QoS to the details and to the view of ports: without it, all other texts are larger."""
    nodes = (
        replace(node, ports=tuple(replace(port, qos="") for port in node.ports))
        for node in scene.nodes
    )
    return replace(scene, nodes=tuple(nodes))


def _nodes_by_executor(graph: Graph) -> dict[str, list[str]]:
    """Return the full names of the nodes in each frame, by its key."""
    found: dict[str, list[str]] = {}
    for vertex in graph.vertices:
        found.setdefault(vertex.cluster, []).append(vertex.key.removeprefix(_NODE))
    return found


def _facts(thing: Cluster | Vertex | Edge) -> dict[str, Any]:
    details = _declared(dict(thing.details))
    ends = (thing.source, thing.target) if isinstance(thing, Edge) else (thing.key,)
    nodes = [end.removeprefix(_NODE) for end in ends if end.startswith(_NODE)]
    return {
        "details": details,
        "problem": None if thing.problem is None else thing.problem.text,
        "mark": None if thing.problem is None else thing.problem.mark.value,
        "node": nodes[0] if nodes else None,
        "channel": details.get("name"),
    }


def _declared(details: dict[str, Any]) -> dict[str, Any]:
    """Return the details without what the page updates."""
    found = {
        name: value
        for name, value in details.items()
        if (name, value) not in (("state", STATE_PLACEHOLDER), ("rate_hz", RATE_PLACEHOLDER_HZ))
    }
    if isinstance(ports := found.get("ports"), list):
        found["ports"] = [_declared(port) for port in ports]
    return found


class Diagrams:
    """Diagrams by what they depend on, laid out once for all pages. Use it on worker threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._known: dict[Hashable, Diagram] = {}

    def of(self, key: Hashable, lay_out: Callable[[], Diagram]) -> Diagram:
        """Return the diagram with this key; the first call lays it out, and others wait for it."""
        # One at a time: layouts are Python code, of which only one thread runs at any time.
        with self._lock:
            diagram = self._known.pop(key, None) or lay_out()
            self._known[key] = diagram
            while len(self._known) > _MAX_DIAGRAMS:
                del self._known[next(iter(self._known))]
            return diagram
