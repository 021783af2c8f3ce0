"""The views of a scene, and the functions that make scenes."""

from __future__ import annotations

from collections.abc import Callable

from composer.graph.channel_views import connections_view, nodes_view
from composer.graph.declared import scene_of
from composer.graph.diagram import Graph
from composer.graph.diagram_options import View
from composer.graph.live import live_scene_of
from composer.graph.node_views import deployment_view, frames_view, lifecycle_view, states_view
from composer.graph.scene import Scene

__all__ = ["View", "build_graph", "live_scene_of", "scene_of"]

_VIEWS: dict[View, Callable[[Scene], Graph]] = {
    View.NODES: nodes_view,
    View.CONNECTIONS: connections_view,
    View.LIFECYCLE: lifecycle_view,
    View.DEPLOYMENT: deployment_view,
    View.STATES: states_view,
    View.FRAMES: frames_view,
}


def build_graph(scene: Scene, view: View = View.NODES) -> Graph:
    """Return the diagram of a scene."""
    return _VIEWS[view](scene)
