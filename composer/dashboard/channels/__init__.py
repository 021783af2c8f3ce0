"""What a browser can subscribe to: one feed per channel, in the module named after it.

To add a channel, add a class derived from :class:`composer.dashboard.feeds.Feed` and its line in
``CHANNELS``.
"""

from __future__ import annotations

from collections.abc import Callable

from composer.dashboard.channels.echo import EchoFeed
from composer.dashboard.channels.goal import GoalFeed
from composer.dashboard.channels.graph import LiveFeed, PictureFeed
from composer.dashboard.channels.image import ImageFeed
from composer.dashboard.channels.log import LogFeed
from composer.dashboard.channels.nodes import NodesFeed
from composer.dashboard.channels.parameters import ParametersFeed
from composer.dashboard.channels.plot import PlotFeed
from composer.dashboard.channels.publishing import PublishingFeed
from composer.dashboard.channels.services import ServicesFeed
from composer.dashboard.channels.timing import TimingFeed
from composer.dashboard.channels.topics import TopicsFeed
from composer.dashboard.declared import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.protocol.messages import Values

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
}
