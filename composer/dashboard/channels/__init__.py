"""What a browser can subscribe to: one feed per channel, in the module named after it.

To add a channel, add a class derived from :class:`composer.dashboard.feeds.Feed` and its line in
``CHANNELS``.
"""

from __future__ import annotations

from collections.abc import Callable

from composer.dashboard.channels.graph import LiveFeed, PictureFeed
from composer.dashboard.channels.nodes import NodesFeed
from composer.dashboard.declared import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.messages import Values

CHANNELS: dict[str, Callable[[Values, Declared | None], Feed]] = {
    "graph": PictureFeed,
    "graph.live": LiveFeed,
    "nodes": NodesFeed,
}
