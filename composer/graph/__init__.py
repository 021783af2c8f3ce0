"""Diagrams of systems and of running ROS graphs.

Systems (``declared``) or a snapshot of a ROS graph (``live``) become a scene, a view (``views/``)
turns a scene into a graph, and a renderer turns the graph into a file format.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

from composer.diagnostics import Diagnostic
from composer.diagram_options import View
from composer.drift import Snapshot
from composer.graph.diagram import Graph
from composer.graph.scenes import declared, live
from composer.graph.scenes.diagnostics import DiagnosticIndex
from composer.graph.scenes.scene import Scene
from composer.graph.views import connections, deployment, frames, lifecycle, nodes, states
from composer.model import System

__all__ = ["View", "build_graph", "live_scene_of", "scene_of"]

_VIEWS: dict[View, Callable[[Scene], Graph]] = {
    View.NODES: nodes.build,
    View.CONNECTIONS: connections.build,
    View.LIFECYCLE: lifecycle.build,
    View.DEPLOYMENT: deployment.build,
    View.STATES: states.build,
    View.FRAMES: frames.build,
}


def scene_of(systems: Sequence[System], diagnostics: Iterable[Diagnostic] = ()) -> Scene:
    """Return the scene of systems; entities with diagnostics are marked."""
    return declared.scene_of(systems, DiagnosticIndex(diagnostics))


def live_scene_of(snapshot: Snapshot, rates_hz: Mapping[str, float]) -> Scene:
    """Return the scene of a running ROS graph; ``rates_hz`` are measured rates by topic."""
    return live.scene_of(snapshot, rates_hz)


def build_graph(scene: Scene, view: View = View.NODES) -> Graph:
    """Return the diagram of a scene."""
    return _VIEWS[view](scene)
