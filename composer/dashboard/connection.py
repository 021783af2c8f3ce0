"""One browser: reads its requests, sends their responses and the updates of its subscriptions.

Requests are answered in any order. Whatever a browser sends, it gets an error with a reason, and
nothing else is affected.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Coroutine
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from composer.dashboard.channels import CHANNELS
from composer.dashboard.channels.goal import GoalFeed
from composer.dashboard.context import Dashboard
from composer.dashboard.errors import BadRequestError, RequestError
from composer.dashboard.feeds import Feed, Receiver
from composer.dashboard.messages import ClientRequest, Values, parse_request, to_json
from composer.dashboard.operations import OPERATIONS
from composer.dashboard.outbox import Outbox, Update
from composer.diagnostics import nearest

_MAX_SUBSCRIPTIONS = 64
_MAX_PENDING = 16
#: A program that sends only malformed messages is disconnected.
_MAX_MALFORMED = 20
_POLICY_VIOLATION, _GOING_AWAY = 1008, 1001
#: Operations of the connection itself.
_OWN = ("subscribe", "unsubscribe", "update", "cancel", "ping")


@dataclass(slots=True)
class _Subscription:
    channel: str
    key: str
    receiver: Receiver
    feed: Feed


class Connection:
    """The connection of one browser."""

    def __init__(self, dashboard: Dashboard, socket: WebSocket) -> None:
        self._dashboard = dashboard
        self._socket = socket
        self._outbox = Outbox()
        self._loop = asyncio.get_running_loop()
        self._subscriptions: dict[int, _Subscription] = {}
        self._next_subscription = 1
        self._pending: set[asyncio.Task[None]] = set()
        self._is_open = True

    async def run(self) -> None:
        """Serve the browser until it leaves."""
        self._outbox.reply(to_json({"hello": self._dashboard.hello}))
        sender = asyncio.create_task(self._send())
        self._dashboard.ros.enter()
        try:
            await self._receive()
        except WebSocketDisconnect:
            pass
        finally:
            self._is_open = False
            for subscription in tuple(self._subscriptions):
                self._unsubscribe(subscription)
            for task in (sender, *self._pending):
                task.cancel()
            self._dashboard.ros.leave()

    async def close(self) -> None:
        """Say that the server ends."""
        if self._socket.application_state is WebSocketState.CONNECTED:
            await self._socket.close(_GOING_AWAY, "the dashboard has ended")

    async def _send(self) -> None:
        try:
            while True:
                message = await self._outbox.next()
                if isinstance(message, bytes):
                    await self._socket.send_bytes(message)
                else:
                    await self._socket.send_text(message)
        except (WebSocketDisconnect, RuntimeError):
            pass  # the browser has left; so does the receiver notice

    async def _receive(self) -> None:
        malformed = 0
        while True:
            message = await self._socket.receive()
            if message["type"] == "websocket.disconnect":
                return
            identifier: int | str | None = None
            try:
                text = message.get("text")
                if text is None:
                    raise BadRequestError("messages must be text, this one is binary")
                request = parse_request(text)
                identifier, malformed = request.id, 0
                self._start(request)
            except RequestError as error:
                malformed += identifier is None
                self._outbox.reply(to_json({"id": identifier, "error": error.as_data()}))
            if malformed >= _MAX_MALFORMED or self._outbox.is_full_of_replies:
                await self._socket.close(_POLICY_VIOLATION, "too many requests without sense")
                return

    def _start(self, request: ClientRequest) -> None:
        """Answer a request at once, or start the task that does. Raises RequestError."""
        values = Values(request.values, f"'{request.op:.40}'")
        if request.op in _OWN:
            result = getattr(self, f"_on_{request.op}")(values)
            self._reply(request, result)
            return
        operation = OPERATIONS.get(request.op)
        if operation is None:
            close = nearest(request.op, (*OPERATIONS, *_OWN))
            hint = f"did you mean '{close}'?" if close else None
            raise BadRequestError(f"there is no operation '{request.op:.80}'", hint)
        if operation.changes:
            self._check_may_change(request.op)
        if len(self._pending) >= _MAX_PENDING:
            raise RequestError("busy", f"{_MAX_PENDING} of your requests are running already")
        call, timeout_s = operation.prepare(values, self._dashboard)
        values.end()
        self._spawn(self._call(request, self._dashboard.ros.call(call, timeout_s)))

    def _check_may_change(self, what: str) -> None:
        if self._dashboard.options.read_only:
            raise RequestError("read_only", f"'{what}' is not possible: the dashboard is read-only")

    def _spawn(self, coroutine: Coroutine[Any, Any, None]) -> None:
        task = self._loop.create_task(coroutine)
        self._pending.add(task)
        task.add_done_callback(self._pending.discard)

    async def _call(self, request: ClientRequest, call: Coroutine[Any, Any, Any]) -> None:
        try:
            self._reply(request, await call)
        except RequestError as error:
            self._outbox.reply(to_json({"id": request.id, "error": error.as_data()}))
        except Exception as error:  # the browser gets an answer in any case
            logging.getLogger(__name__).exception("the request '%s' failed", request.op)
            text = f"an internal error of the dashboard: {error!r:.200}"
            data = RequestError("internal", text).as_data()
            self._outbox.reply(to_json({"id": request.id, "error": data}))

    def _reply(self, request: ClientRequest, result: Any) -> None:
        self._outbox.reply(to_json({"id": request.id, "ok": result}))

    def _on_ping(self, values: Values) -> dict[str, Any]:
        values.end()
        return {"state": self._dashboard.ros.state, "message": self._dashboard.ros.message}

    def _on_subscribe(self, values: Values) -> dict[str, Any]:
        channel, parameters = values.text("channel"), values.mapping("params")
        values.end()
        if len(self._subscriptions) >= _MAX_SUBSCRIPTIONS:
            raise RequestError("too_many", f"{_MAX_SUBSCRIPTIONS} subscriptions are the limit")
        feed = self._feed(channel, parameters)
        number, self._next_subscription = self._next_subscription, self._next_subscription + 1
        self._outbox.open(number, channel, feed.delivery)
        self._subscriptions[number] = self._attach(number, channel, parameters, feed)
        return {"sub": number}

    def _on_update(self, values: Values) -> dict[str, Any]:
        number, parameters = self._number(values), values.mapping("params")
        values.end()
        before = self._subscriptions[number]
        feed = self._feed(before.channel, parameters)
        # The new feed is attached first, so that shared subscriptions continue.
        self._subscriptions[number] = self._attach(number, before.channel, parameters, feed)
        self._dashboard.feeds.remove(before.key, before.receiver)
        return {}

    def _on_unsubscribe(self, values: Values) -> dict[str, Any]:
        number = self._number(values)
        values.end()
        self._unsubscribe(number)
        return {}

    def _on_cancel(self, values: Values) -> dict[str, Any]:
        number = self._number(values)
        values.end()
        self._check_may_change("cancel")
        feed = self._subscriptions[number].feed
        if not isinstance(feed, GoalFeed):
            raise BadRequestError(f"subscription {number} is not a goal")
        feed.cancel()
        return {}

    def _number(self, values: Values) -> int:
        number = values.any("sub")
        if type(number) is not int or number not in self._subscriptions:
            raise BadRequestError(f"there is no subscription {number!r:.40}")
        return number

    def _feed(self, channel: str, parameters: Any) -> Feed:
        """Return the feed of a channel with parameters. Raises RequestError."""
        feed_class = CHANNELS.get(channel)
        if feed_class is None:
            close = nearest(channel, CHANNELS)
            hint = f"did you mean '{close}'?" if close else None
            raise BadRequestError(f"there is no channel '{channel:.80}'", hint)
        feed = feed_class(Values(parameters, f"'params' of '{channel}'"), self._dashboard.declared)
        if feed.changes:
            self._check_may_change(channel)
        return feed

    def _attach(self, number: int, channel: str, parameters: Any, feed: Feed) -> _Subscription:
        """Send the updates of a feed, or of the same one that runs already, to the browser."""
        key = f"{channel} {to_json(parameters)}"
        if not feed.is_shared:
            key = f"{key} {id(self)} {number}"

        def receive(update: Update) -> None:
            """Take an update on the thread of feeds."""
            if self._is_open:
                with suppress(RuntimeError):  # the server ends
                    self._loop.call_soon_threadsafe(self._outbox.put, number, update)

        self._dashboard.feeds.add(key, feed, receive)
        return _Subscription(channel, key, receive, feed)

    def _unsubscribe(self, number: int) -> None:
        subscription = self._subscriptions.pop(number)
        self._outbox.close(number)
        self._dashboard.feeds.remove(subscription.key, subscription.receiver)
