"""What a browser can subscribe to: one feed per channel.

To add a channel, add a class derived from :class:`composer.dashboard.feeds.Feed` and its line in
``CHANNELS``. Its ``__init__`` reads the parameters of a subscription: it raises RequestError.
"""

from __future__ import annotations

from collections.abc import Callable

from composer.dashboard.channels.graph import LiveFeed, PictureFeed
from composer.dashboard.channels.messages import EchoFeed, ImageFeed, LogFeed, PlotFeed
from composer.dashboard.channels.nodes import NodesFeed, ParametersFeed, TimingFeed
from composer.dashboard.channels.sending import GoalFeed, PublishingFeed
from composer.dashboard.channels.topics import ServicesFeed, TopicsFeed
from composer.dashboard.context import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.protocol.messages import Values
from composer.dashboard.recordings import BagsFeed

CHANNELS: dict[str, Callable[[Values, Declared | None], Feed]] = {
    "graph": PictureFeed,
    "graph.live": LiveFeed,
    "nodes": NodesFeed,
    "timing": TimingFeed,
    "topics": TopicsFeed,
    "echo": EchoFeed,
    "plot": PlotFeed,
    "image": ImageFeed,
    "publishing": PublishingFeed,
    "services": ServicesFeed,
    "goal": GoalFeed,
    "parameters": ParametersFeed,
    "log": LogFeed,
    "bags": BagsFeed,
}
