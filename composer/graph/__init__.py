"""Diagrams: systems or a running graph become a scene, a scene a graph (``views/``), that a text.

One file makes a scene (``declared``, ``live``), one a view, one a format.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import StrEnum

from composer.diagnostics import Diagnostic
from composer.drift import Snapshot
from composer.graph import declared, live
from composer.graph.diagnostics import DiagnosticIndex
from composer.graph.picture import Graph
from composer.graph.scene import Scene
from composer.graph.views import connections, deployment, lifecycle, nodes, states
from composer.model import System


class View(StrEnum):
    """The ways to look at a system."""

    NODES = "nodes"
    CONNECTIONS = "connections"
    LIFECYCLE = "lifecycle"
    DEPLOYMENT = "deployment"
    STATES = "states"


_VIEWS: dict[View, Callable[[Scene], Graph]] = {
    View.NODES: nodes.build,
    View.CONNECTIONS: connections.build,
    View.LIFECYCLE: lifecycle.build,
    View.DEPLOYMENT: deployment.build,
    View.STATES: states.build,
}


def scene_of(systems: Sequence[System], diagnostics: Iterable[Diagnostic] = ()) -> Scene:
    """Return what there is to see in systems; what a diagnostic points at is marked as wrong."""
    return declared.scene_of(systems, DiagnosticIndex(diagnostics))


def live_scene_of(snapshot: Snapshot, rates_hz: Mapping[str, float]) -> Scene:
    """Return what there is to see in a running ROS graph; rates are measured, by topic."""
    return live.scene_of(snapshot, rates_hz)


def build_graph(scene: Scene, view: View = View.NODES) -> Graph:
    """Return the diagram of a scene."""
    return _VIEWS[view](scene)
