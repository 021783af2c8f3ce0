"""What begins while a browser loads the page, so that the first view is ready with its scripts."""

from __future__ import annotations

import asyncio

from composer.dashboard.channels.graph import DiagramFeed
from composer.dashboard.context import Dashboard
from composer.dashboard.protocol.errors import RequestError
from composer.dashboard.protocol.messages import Values
from composer.dashboard.protocol.outbox import Update
from composer.dashboard.ros_side import LINGER_S

_KEY = "diagram of a page that is being loaded"


def prepare(dashboard: Dashboard, path: str, diagram: str) -> None:
    """Join the ROS graph for a page, and lay out its diagram if its path is that of the graph."""
    dashboard.ros.enter()
    dashboard.ros.leave()  # the page connects before the dashboard leaves the graph
    if path.split("/")[1] not in ("", "graph"):
        return
    try:
        feed = DiagramFeed(Values({"view": diagram}, _KEY), dashboard.declared)
    except RequestError:  # the page gets it when it subscribes
        return

    def receive(_: Update) -> None:
        pass

    key = f"{_KEY}: {diagram}"
    dashboard.feeds.add(key, feed, receive)
    asyncio.get_running_loop().call_later(LINGER_S, dashboard.feeds.remove, key, receive)
