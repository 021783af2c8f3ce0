"""What waits to be sent to one browser, in bounded memory.

A browser that reads slowly gets the latest value of a state and skips those in between. Messages
that it should see one by one wait in a short queue; the oldest are dropped and counted. Nothing
here waits for a browser, so a browser never delays anything else.
"""

from __future__ import annotations

import asyncio
from collections import deque
from dataclasses import dataclass, field
from enum import StrEnum

#: Batches of messages that wait for each subscription, and bytes that wait for one browser.
MAX_BATCHES = 8
MAX_BYTES = 16 * 1024 * 1024
MAX_REPLIES = 256


class Delivery(StrEnum):
    """How updates of a channel wait: only the last one, or one after the other."""

    LATEST = "latest"
    QUEUE = "queue"


@dataclass(frozen=True, slots=True)
class Update:
    """An update of a channel: JSON text, or a binary payload with its ``header`` of JSON text.

    ``count`` is the number of messages in it; ``dropped`` the messages before it that the channel
    left out because of its rate limit. ``ended`` says that no update follows.
    """

    data: str | bytes
    count: int = 1
    dropped: int = 0
    header: str = ""
    is_error: bool = False
    ended: bool = False

    @property
    def size(self) -> int:
        """The approximate size in bytes."""
        return len(self.data) + len(self.header)


@dataclass(slots=True)
class _Waiting:
    """The updates that wait for one subscription."""

    channel: str
    delivery: Delivery
    updates: deque[Update] = field(default_factory=deque)
    sequence: int = 0
    dropped: int = 0


class Outbox:
    """Everything that waits for one browser. Use it on the thread of the event loop only."""

    def __init__(self) -> None:
        self._subscriptions: dict[int, _Waiting] = {}
        self._replies: deque[str] = deque()
        self._due: dict[int, None] = {}  # subscriptions with updates, in the order of their turns
        self._size = 0
        self._ready = asyncio.Event()

    @property
    def size(self) -> int:
        """The number of bytes that wait."""
        return self._size

    @property
    def is_full_of_replies(self) -> bool:
        """Whether the browser sends requests without reading the replies."""
        return len(self._replies) >= MAX_REPLIES

    def open(self, subscription: int, channel: str, delivery: Delivery) -> None:
        """Accept updates for a new subscription."""
        self._subscriptions[subscription] = _Waiting(channel, delivery)

    def close(self, subscription: int) -> None:
        """Discard what waits for a subscription, and accept nothing more for it."""
        waiting = self._subscriptions.pop(subscription, None)
        self._due.pop(subscription, None)
        if waiting is not None:
            self._size -= sum(update.size for update in waiting.updates)

    def reply(self, text: str) -> None:
        """Add the response to a request; responses are sent before updates."""
        self._replies.append(text)
        self._size += len(text)
        self._ready.set()

    def put(self, subscription: int, update: Update) -> None:
        """Add an update; older ones are dropped if too many wait."""
        waiting = self._subscriptions.get(subscription)
        if waiting is None:
            return
        waiting.dropped += update.dropped
        limit = 1 if waiting.delivery is Delivery.LATEST else MAX_BATCHES
        while waiting.updates and len(waiting.updates) >= limit:
            self._drop_oldest(waiting)
        while waiting.updates and self._size + update.size > MAX_BYTES:
            self._drop_oldest(waiting)
        if self._size + update.size > MAX_BYTES:
            waiting.dropped += update.count
            return
        waiting.updates.append(update)
        self._size += update.size
        self._due[subscription] = None
        self._ready.set()

    async def next(self) -> str | bytes:
        """Return the next message for the browser, once there is one."""
        while not self._replies and not self._due:
            self._ready.clear()
            await self._ready.wait()
        if self._replies:
            text = self._replies.popleft()
            self._size -= len(text)
            return text
        subscription = next(iter(self._due))
        del self._due[subscription]
        waiting = self._subscriptions[subscription]
        update = waiting.updates.popleft()
        self._size -= update.size
        if waiting.updates:
            self._due[subscription] = None  # at the end: every subscription gets its turn
        return _message(subscription, waiting, update)

    def _drop_oldest(self, waiting: _Waiting) -> None:
        update = waiting.updates.popleft()
        waiting.dropped += update.count
        self._size -= update.size


def _message(subscription: int, waiting: _Waiting, update: Update) -> str | bytes:
    """Return an update as it is sent."""
    sequence, waiting.sequence = waiting.sequence, waiting.sequence + 1
    head = f'"sub":{subscription},"seq":{sequence},"dropped":{waiting.dropped}'
    if isinstance(update.data, bytes):
        header = f"{{{head},{update.header[1:]}".encode()
        return len(header).to_bytes(4, "big") + header + update.data
    ended = ',"ended":true' if update.ended else ""
    kind = "error" if update.is_error else "data"
    return f'{{{head},"channel":"{waiting.channel}"{ended},"{kind}":{update.data}}}'
