"""The ROS graph as running systems on this computer see it, without joining it."""

from __future__ import annotations

from composer.runtime.process.instance_lock import local_systems
from composer.runtime.process.query_socket import GraphView, NameAndTypes, read_graph, visible

#: Longer than a manager waits for its view to become complete.
RESPONSE_S = 0.6


def local_names(
    kind: str, timeout_s: float, *, hidden: bool = False
) -> tuple[NameAndTypes, ...] | None:
    """Return the names that :meth:`composer.client.graph_names.GraphNames.names` would return.

    None if no system on this computer is certain about them.
    """
    view = local_view(timeout_s)
    if view is None:
        return None
    return view[kind] if hidden else visible(view[kind])


def local_view(timeout_s: float) -> GraphView | None:
    """Return the whole graph; None if no system on this computer is certain about it."""
    views = (read_graph(system, min(RESPONSE_S, timeout_s)) for system in local_systems())
    return next((view for view in views if view is not None), None)
