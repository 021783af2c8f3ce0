"""``goal``: a goal that is sent to an action, its feedback and its result."""

from __future__ import annotations

from collections.abc import Iterator

from composer.dashboard.declared import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.messages import Values
from composer.dashboard.outbox import Update


class GoalFeed(Feed):
    is_shared = False
    changes = True

    def __init__(self, values: Values, declared: Declared | None) -> None:
        del declared

    def cancel(self) -> None: ...

    def poll(self) -> Iterator[Update]:
        yield from ()
