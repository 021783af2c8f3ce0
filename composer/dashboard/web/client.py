"""One program that is connected by a WebSocket: receives its messages, sends what waits for it.

Whatever it sends, it gets an error with a reason, and nothing else is affected.
"""

from __future__ import annotations

import asyncio
import logging
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Coroutine
from contextlib import suppress
from functools import partial
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from composer.base.characters import escape_line
from composer.dashboard.context import Dashboard, Run
from composer.dashboard.feeds import Feed, Receiver
from composer.dashboard.protocol.messages import BadRequestError, RequestError, internal_error
from composer.dashboard.protocol.outbox import Outbox, Update
from composer.runtime.clock import COMPUTER
from composer.runtime.metrics.repeat_limit import RepeatLimit

_LOG = logging.getLogger(__name__)
#: Requests of one program that run at the same time.
_MAX_PENDING = 16
#: A program that sends only malformed messages is disconnected.
_MAX_MALFORMED = 20
POLICY_VIOLATION, _GOING_AWAY = 1008, 1001


#: Ends a subscription to a feed.
End = Callable[[], None]


class Client(ABC):
    """The connection of one program; a subclass adds the protocol."""

    def __init__(self, dashboard: Dashboard, socket: WebSocket, outbox: Outbox) -> None:
        self._dashboard = dashboard
        self._socket = socket
        self._outbox = outbox
        self._loop = asyncio.get_running_loop()
        self._pending: set[asyncio.Task[None]] = set()
        #: Updates of feeds on their way to the thread of the event loop.
        self._arrived: deque[tuple[Callable[[Update], None], Update]] = deque()
        self._is_woken = False
        self._is_open = True
        self._repeats = RepeatLimit(COMPUTER)
        self._size = 0  # of the message that is handled

    async def run(self) -> None:
        """Serve the program until it leaves."""
        sender = asyncio.create_task(self._send())
        self._dashboard.ros.enter()
        try:
            self._begin()
            await self._receive()
        except WebSocketDisconnect:
            pass
        finally:
            self._is_open = False
            self._end()
            for task in (sender, *self._pending):
                task.cancel()
            self._dashboard.ros.leave()

    async def close(self) -> None:
        """Say that the server ends."""
        await self._close(_GOING_AWAY, "the dashboard has ended")

    @abstractmethod
    def _begin(self) -> None:
        """Send the first message."""

    @abstractmethod
    def _take(self, message: str | bytes) -> bool:
        """Start what a message requests, or answer with an error; return whether it is valid."""

    @abstractmethod
    def refuse(self, error: RequestError) -> None:
        """Say why a message is refused."""

    @abstractmethod
    def _end(self) -> None:
        """End all subscriptions."""

    @property
    def is_read_only(self) -> bool:
        """Whether the program may change nothing."""
        return self._dashboard.options.read_only

    def check_may_change(self, what: str) -> None:
        """Raise RequestError if the dashboard is read-only."""
        if self.is_read_only:
            raise RequestError("read_only", f"{what} is not possible: the dashboard is read-only")

    def start(self, key: str, feed: Feed, take: Callable[[Update], None]) -> End:
        """Receive a feed, which programs share under this key if it can be shared."""
        key, receiver = key if feed.is_shared else f"{key} {id(feed)}", self._receiver(take)
        self._dashboard.feeds.add(key, feed, receiver)
        return partial(self._dashboard.feeds.remove, key, receiver)

    def request(
        self,
        run: Run,
        timeout_s: float,
        done: Callable[[Any], None],
        fail: Callable[[RequestError], None],
    ) -> None:
        """Run something on a worker thread; ``done`` or ``fail`` answer.

        Raises RequestError if too many requests of this program run, or keep too many bytes.
        """
        if len(self._pending) >= _MAX_PENDING:
            raise RequestError("busy", f"{_MAX_PENDING} of your requests are running already")

        async def answer() -> None:
            try:
                done(await self._dashboard.ros.call(run, timeout_s))
            except RequestError as error:
                fail(error)
            except Exception as error:  # the program gets an answer in any case
                fail(internal_error("a request", error))

        self._spawn(answer, self._size)

    async def _close(self, code: int, reason: str) -> None:
        if self._socket.application_state is WebSocketState.CONNECTED:
            await self._socket.close(code, reason)

    async def _send(self) -> None:
        try:
            while True:
                message = await self._outbox.next()
                if isinstance(message, bytes):
                    await self._socket.send_bytes(message)
                else:
                    await self._socket.send_text(message)
        except (WebSocketDisconnect, RuntimeError):
            pass  # the program has left; so does the receiver notice

    async def _receive(self) -> None:
        malformed = 0
        while True:
            message = await self._socket.receive()
            if message["type"] == "websocket.disconnect":
                return
            text = message.get("text")
            is_valid = self._handle(message.get("bytes") or b"" if text is None else text)
            malformed = 0 if is_valid else malformed + 1
            if malformed >= _MAX_MALFORMED or self._outbox.is_full_of_replies:
                await self._close(POLICY_VIOLATION, "too many requests without sense")
                return

    def _handle(self, message: str | bytes) -> bool:
        """Start what a message requests; return whether it is valid."""
        self._size = len(message)
        try:
            return self._take(message)
        except Exception as error:  # of one message, which must not end the connection
            self.refuse(internal_error("a message", error))
            return False

    def _log_refused(self, error: RequestError) -> None:
        """Log a message that makes no sense, in one line."""
        if isinstance(error, BadRequestError):
            admission = self._repeats.admit("")
            if admission is not None:
                text = escape_line(f"{error!s:.200}")
                _LOG.warning("a message is refused: %s%s", text, admission.suffix)

    def _spawn(self, run: Callable[[], Coroutine[Any, Any, None]], size: int = 0) -> None:
        """Run a coroutine that keeps a message of a size. Raises RequestError if that is too much.

        There is always room for a size of 0.
        """
        self._outbox.budget.take(size)
        task = self._loop.create_task(run())
        self._pending.add(task)

        def end(_: asyncio.Task[None]) -> None:
            self._pending.discard(task)
            self._outbox.budget.give(size)

        task.add_done_callback(end)

    def _receiver(self, take: Callable[[Update], None]) -> Receiver:
        """Return a receiver for the thread of feeds; ``take`` gets the updates on this thread."""

        def receive(update: Update) -> None:
            if not self._is_open:
                return
            self._arrived.append((take, update))
            if not self._is_woken:
                self._is_woken = True
                with suppress(RuntimeError):  # the server ends
                    self._loop.call_soon_threadsafe(self._take_arrived)

        return receive

    def _take_arrived(self) -> None:
        self._is_woken = False  # first: what arrives from now on wakes the loop again
        while self._arrived:
            take, update = self._arrived.popleft()
            take(update)
