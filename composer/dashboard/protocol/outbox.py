"""What waits to be sent to one browser, in bounded memory.

A browser that reads slowly gets the latest value of a state and skips those in between. Messages
that it should see one by one wait in a short queue; the oldest are dropped and counted. Nothing
here waits for a browser, so a browser never delays anything else.

Everything that is kept for a connection is counted in bytes: updates and replies that wait to be
sent, messages that wait to be published, requests that run, and the names and parameters of its
subscriptions. So all of them together take at most ``MAX_CONNECTIONS * CONNECTION_BYTES``. In
addition, each has a message that is being received (``MAX_MESSAGE``) and one that is being sent.
"""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import field
from enum import StrEnum

from composer.base.fast_dataclass import dataclass
from composer.dashboard.protocol.messages import RequestError

#: Browsers and programs that are connected at the same time.
MAX_CONNECTIONS = 32
#: What is kept for one of them, in bytes.
CONNECTION_BYTES = 16 * 1024 * 1024
#: The largest message of a browser or program, in bytes.
MAX_MESSAGE = 1024 * 1024
#: Batches of messages that wait for each subscription.
MAX_BATCHES = 8
#: Bytes that wait for one subscription: of large messages only the latest are of use.
MAX_QUEUED_BYTES = 2 * 1024 * 1024
MAX_REPLIES = 256


class Budget:
    """The bytes that are kept for one connection. Thread-safe."""

    def __init__(self, limit: int = CONNECTION_BYTES) -> None:
        self._limit = limit
        self._lock = threading.Lock()
        self._used = 0

    @property
    def used(self) -> int:
        """The number of bytes that are kept."""
        return self._used

    def has(self, size: int) -> bool:
        """Return whether so many more bytes may be kept."""
        return self._used + size <= self._limit

    def take(self, size: int) -> None:
        """Count bytes that are kept from now on. Raises RequestError if they are too many."""
        with self._lock:
            if not self.has(size):
                limit = f"{self._limit // 1024**2} MB"
                raise RequestError("too_many", f"{limit} are the limit for all that waits for you")
            self._used += size

    def give(self, size: int) -> None:
        """Count bytes that are not kept any more."""
        with self._lock:
            self._used -= size


class Delivery(StrEnum):
    """How updates of a channel wait: only the last one, or one after the other."""

    LATEST = "latest"
    QUEUE = "queue"


@dataclass(frozen=True, slots=True)
class Update:
    """An update of a channel: JSON text, or a binary payload with its ``header`` of JSON text.

    ``count`` is the number of messages in it; ``dropped`` the messages before it that the channel
    left out because of its rate limit. ``ended`` says that no update follows. ``at_ns`` is when a
    binary payload arrived, in nanoseconds since 1970.
    """

    data: str | bytes
    count: int = 1
    dropped: int = 0
    header: str = ""
    is_error: bool = False
    ended: bool = False
    at_ns: int = 0

    @property
    def size(self) -> int:
        """The approximate size in bytes."""
        return len(self.data) + len(self.header)


@dataclass(slots=True)
class Waiting:
    """The updates that wait for one subscription."""

    channel: str
    delivery: Delivery
    updates: deque[Update] = field(default_factory=deque)
    sequence: int = 0
    dropped: int = 0
    size: int = 0


#: Returns an update of a subscription as it is sent.
Compose = Callable[[int, Waiting, Update], "str | bytes"]


class Outbox:
    """Everything that waits for one browser. Use it on the thread of the event loop only."""

    def __init__(self, compose: Compose | None = None, max_batches: int = MAX_BATCHES) -> None:
        """Send updates as ``compose`` returns them, by default in the protocol of the page."""
        self._compose = compose or _message
        self._max_batches = max_batches
        self._subscriptions: dict[int, Waiting] = {}
        self._replies: deque[str | bytes] = deque()
        self._has_lost_replies = False
        self._due: dict[int, None] = {}  # subscriptions with updates, in the order of their turns
        #: The bytes of what waits here, and of all else that is kept for this browser.
        self.budget = Budget()
        self._ready = asyncio.Event()

    @property
    def is_full_of_replies(self) -> bool:
        """Whether the browser sends requests without reading the replies."""
        return self._has_lost_replies or len(self._replies) >= MAX_REPLIES

    def dropped(self, subscription: int) -> int:
        """Return how many messages of a subscription were dropped."""
        waiting = self._subscriptions.get(subscription)
        return 0 if waiting is None else waiting.dropped

    def open(self, subscription: int, channel: str, delivery: Delivery) -> None:
        """Accept updates for a new subscription."""
        self._subscriptions[subscription] = Waiting(channel, delivery)

    def close(self, subscription: int) -> None:
        """Discard what waits for a subscription, and accept nothing more for it."""
        waiting = self._subscriptions.pop(subscription, None)
        self._due.pop(subscription, None)
        if waiting is not None:
            self.budget.give(waiting.size)

    def reply(self, message: str | bytes) -> None:
        """Add the response to a request; responses are sent before updates."""
        try:
            self.budget.take(len(message))
        except RequestError:
            self._has_lost_replies = True
            return
        self._replies.append(message)
        self._ready.set()

    def put(self, subscription: int, update: Update) -> None:
        """Add an update; older ones are dropped if too many wait."""
        waiting = self._subscriptions.get(subscription)
        if waiting is None:
            return
        waiting.dropped += update.dropped
        limit = 1 if waiting.delivery is Delivery.LATEST else self._max_batches
        while waiting.updates and (
            len(waiting.updates) >= limit
            or waiting.size + update.size > MAX_QUEUED_BYTES
            or not self.budget.has(update.size)
        ):
            self._drop_oldest(waiting)
        try:
            self.budget.take(update.size)
        except RequestError:
            waiting.dropped += update.count
            return
        waiting.updates.append(update)
        waiting.size += update.size
        self._due[subscription] = None
        self._ready.set()

    async def next(self) -> str | bytes:
        """Return the next message for the browser, once there is one."""
        while not self._replies and not self._due:
            self._ready.clear()
            await self._ready.wait()
        if self._replies:
            reply = self._replies.popleft()
            self.budget.give(len(reply))
            return reply
        subscription = next(iter(self._due))
        del self._due[subscription]
        waiting = self._subscriptions[subscription]
        update = waiting.updates.popleft()
        waiting.size -= update.size
        self.budget.give(update.size)
        if waiting.updates:
            self._due[subscription] = None  # at the end: every subscription gets its turn
        return self._compose(subscription, waiting, update)

    def _drop_oldest(self, waiting: Waiting) -> None:
        update = waiting.updates.popleft()
        waiting.dropped += update.count
        waiting.size -= update.size
        self.budget.give(update.size)


def _message(subscription: int, waiting: Waiting, update: Update) -> str | bytes:
    """Return an update as it is sent."""
    sequence, waiting.sequence = waiting.sequence, waiting.sequence + 1
    head = f'"sub":{subscription},"seq":{sequence},"dropped":{waiting.dropped}'
    if isinstance(update.data, bytes):
        header = f"{{{head},{update.header[1:]}".encode()
        return len(header).to_bytes(4, "big") + header + update.data
    ended = ',"ended":true' if update.ended else ""
    kind = "error" if update.is_error else "data"
    return f'{{{head},"channel":"{waiting.channel}"{ended},"{kind}":{update.data}}}'
