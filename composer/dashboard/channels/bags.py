"""``bags``: recordings in the folder of the dashboard, and what is recorded and played."""

from __future__ import annotations

from collections.abc import Iterator

from composer.dashboard.declared import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.protocol.messages import Values, to_json
from composer.dashboard.protocol.outbox import Update
from composer.dashboard.recordings import RECORDINGS


class BagsFeed(Feed):
    """The bags, every second."""

    def __init__(self, values: Values, _: Declared | None) -> None:
        del values
        self._last = ""

    def poll(self) -> Iterator[Update]:
        """Yield the list if something has changed."""
        text = to_json(RECORDINGS.state())
        if text != self._last:
            self._last = text
            yield Update(text)
