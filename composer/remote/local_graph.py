"""The ROS graph as running systems on this computer see it, without joining it."""

from __future__ import annotations

from composer.runtime.process.graph_socket import NameAndTypes, read_graph, visible
from composer.runtime.process.instance_lock import local_systems

#: Longer than a manager waits for its view to become complete.
_RESPONSE_S = 0.6


def local_names(
    kind: str, timeout_s: float, *, hidden: bool = False
) -> tuple[NameAndTypes, ...] | None:
    """Return the names that :meth:`composer.remote.graph_names.GraphNames.names` would return.

    None if no system on this computer is certain about them.
    """
    limit_s = min(_RESPONSE_S, timeout_s)
    if limit_s <= 0.0:
        return None
    views = (read_graph(system, limit_s) for system in local_systems())
    view = next((view for view in views if view is not None), None)
    if view is None:
        return None
    return view[kind] if hidden else visible(view[kind])
