"""Runs the feeds of all channels on one thread, each only while a browser subscribes to it."""

from __future__ import annotations

import math
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from functools import partial
from typing import TYPE_CHECKING

from composer.dashboard.protocol.messages import RequestError, from_ros, internal_error, to_json
from composer.dashboard.protocol.outbox import Delivery, Update

if TYPE_CHECKING:
    from composer.dashboard.observing.ros_graph import RosGraph

#: A feed that fails is tried again after this time.
_RETRY_S = 1.0
_ALIGNED_S = 1.0
#: A feed of reports is polled at most this often, however many systems report.
_REPORT_GAP_S = 0.2
#: A feed of reports waits this many periods for the next report.
_REPORT_PERIODS = 1.5
#: Takes the updates of a feed, on any thread.
Receiver = Callable[[Update], None]


class Feed(ABC):
    """The data of a channel for one set of parameters. All methods run on the thread of feeds.

    They must not block: what takes longer belongs to the worker threads of ``ros``.
    """

    #: How updates wait for a slow browser.
    delivery = Delivery.LATEST
    #: Whether subscriptions with equal parameters share one feed.
    is_shared = True
    #: Whether it changes something, which a read-only dashboard refuses.
    changes = False
    #: How often :meth:`poll` is called.
    period_s = 1.0
    #: Whether to poll whenever a system has reported, instead of after each period.
    follows_reports = False
    #: Polls this feed at once, on any thread. This and the next two are set before :meth:`start`.
    poll_soon: Callable[[], None]
    ros: RosGraph
    #: What to release when nothing receives the feed any more.
    resources: ExitStack

    def start(self) -> None:  # noqa: B027 - optional
        """Begin to observe; called once before the first poll. Raises RequestError, RosError."""

    @abstractmethod
    def poll(self) -> Iterable[Update]:
        """Return what is new. Raises RequestError, which is sent; the next poll follows."""


class RunningFeed:
    """A feed with its receivers and the time of its next poll."""

    def __init__(self, feed: Feed, key: str) -> None:
        self.feed = feed
        self.key = key
        self.receivers: dict[Receiver, None] = {}
        self.due_s = 0.0
        self.polled_s = 0.0
        self.has_report = False
        self.last: Update | None = None
        self.is_started = False
        self.is_urgent = False
        self.last_error = ""

    @property
    def next_s(self) -> float:
        """When the feed is to be polled (seconds, time.monotonic)."""
        return 0.0 if self.is_urgent else self.due_s


class Feeds:
    """All running feeds. Receivers may be added and removed on any thread."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._running: dict[str, RunningFeed] = {}
        self._closing: list[RunningFeed] = []
        self._outgoing: list[tuple[Receiver, Update]] = []
        self._is_open = True

    def add(self, key: str, feed: Feed, receiver: Receiver) -> None:
        """Add a receiver to the running feed with this key, or else to ``feed``."""
        with self._changed:
            running = self._running.get(key)
            if running is None:
                running = self._running[key] = RunningFeed(feed, key)
                feed.poll_soon = partial(self.poll_soon, key)
            running.receivers[receiver] = None
            last = running.last
            if last is not None:
                receiver(last)
            self._changed.notify()

    def remove(self, key: str, receiver: Receiver) -> None:
        """Remove a receiver; a feed without receivers is closed."""
        with self._changed:
            running = self._running.get(key)
            if running is None:
                return
            running.receivers.pop(receiver, None)
            if not running.receivers:
                self._closing.append(self._running.pop(key))
                self._changed.notify()

    def poll_soon(self, key: str) -> None:
        """Poll the running feed with this key at once, because there is something to do."""
        with self._changed:
            running = self._running.get(key)
            if running is not None:
                running.is_urgent = True
                self._changed.notify()

    def poll_reports(self) -> None:
        """Poll the feeds that follow the reports of systems, because one has arrived."""
        with self._changed:
            for running in self._running.values():
                if running.feed.follows_reports and running.is_started:
                    running.has_report = True
                    running.due_s = min(running.due_s, running.polled_s + _REPORT_GAP_S)
                    self._changed.notify()

    def stop(self) -> None:
        """Make :meth:`run` return."""
        with self._changed:
            self._is_open = False
            self._changed.notify()

    def run(self, ros: RosGraph, is_needed: Callable[[], bool]) -> None:
        """Poll the feeds until ``is_needed()`` is false or :meth:`stop` is called."""
        try:
            while self._is_open and is_needed():
                closing, due = self._wait()
                # In this order: what is replaced must not be forgotten by what both observe.
                for running in due:
                    self._poll(running, ros)
                for running in closing:
                    self._close(running)
                self._deliver()
        finally:
            with self._changed:
                known = [*self._closing, *self._running.values()]
                self._closing.clear()
            for running in known:
                self._close(running)

    def _wait(self) -> tuple[list[RunningFeed], list[RunningFeed]]:
        """Wait until something is to do, for a second at most; return what to close and poll."""
        with self._changed:
            now_s = time.monotonic()
            next_s = min((item.next_s for item in self._running.values()), default=now_s + 1.0)
            if not self._closing and next_s > now_s:
                self._changed.wait(min(next_s - now_s, 1.0))
                now_s = time.monotonic()
            closing, self._closing = self._closing, []
            return closing, [item for item in self._running.values() if item.next_s <= now_s]

    def _poll(self, running: RunningFeed, ros: RosGraph) -> None:
        from composer.client.session import RosError

        running.is_urgent = False
        running.polled_s = time.monotonic()
        has_report, running.has_report = running.has_report, False
        try:
            if not running.is_started:
                running.due_s = running.polled_s
                running.feed.ros = ros
                with ExitStack() as resources:
                    running.feed.resources = resources
                    running.feed.start()
                    running.feed.resources = resources.pop_all()
                running.is_started = True
            for update in running.feed.poll():
                running.last_error = ""
                self._send(running, update)
            self._plan(running, has_report=has_report)
        except RequestError as error:
            self._fail(running, error)
        except RosError as error:
            self._fail(running, from_ros(error))
        except Exception as error:  # an unexpected message must not end the other feeds
            self._fail(running, internal_error(f"the channel {running.key:.200}", error))

    def _plan(self, running: RunningFeed, *, has_report: bool) -> None:
        """Set when the next poll is due; after a report, the next report is awaited."""
        with self._changed:
            if running.has_report:  # it arrived meanwhile
                running.due_s = running.polled_s + _REPORT_GAP_S
            elif has_report:
                running.due_s = running.polled_s + running.feed.period_s * _REPORT_PERIODS
            else:
                running.due_s = _next_s(running.due_s, running.feed.period_s)

    def _fail(self, running: RunningFeed, error: RequestError) -> None:
        running.due_s = time.monotonic() + max(_RETRY_S, running.feed.period_s)
        text = to_json(error.as_data())
        if text != running.last_error:
            running.last_error = text
            self._send(running, Update(text, is_error=True))

    def _send(self, running: RunningFeed, update: Update) -> None:
        with self._changed:
            if running.feed.delivery is Delivery.LATEST:
                running.last = update  # for later receivers
            self._outgoing += [(receiver, update) for receiver in running.receivers]

    def _deliver(self) -> None:
        """Pass on the updates of all feeds at once: each wake-up of the web server costs time."""
        outgoing, self._outgoing = self._outgoing, []
        for receiver, update in outgoing:
            receiver(update)

    def _close(self, running: RunningFeed) -> None:
        if not running.is_started:
            return
        running.is_started = False
        running.last = None
        try:
            running.feed.resources.close()
        except Exception as error:
            internal_error(f"the end of the channel {running.key:.200}", error)


def _next_s(due_s: float, period_s: float) -> float:
    """Return when the next poll is due.

    Slow feeds are polled at the same times, so that the thread wakes up once for all of them.
    """
    now_s = time.monotonic()
    if period_s < _ALIGNED_S:
        return max(due_s + period_s, now_s)
    return (math.floor(now_s / period_s) + 1) * period_s
