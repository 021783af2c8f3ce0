"""One browser: reads its requests, sends their responses and the updates of its subscriptions.

Requests are answered in any order. Whatever a browser sends, it gets an error with a reason, and
nothing else is affected.
"""

from __future__ import annotations

from functools import partial
from typing import Any

from starlette.websockets import WebSocket

from composer.base.fast_dataclass import dataclass
from composer.dashboard.channels import CHANNELS
from composer.dashboard.channels.sending import GoalFeed
from composer.dashboard.context import Dashboard
from composer.dashboard.feeds import Feed
from composer.dashboard.operations import OPERATIONS
from composer.dashboard.protocol.messages import (
    BadRequestError,
    ClientRequest,
    RequestError,
    Values,
    check_characters,
    internal_error,
    parse_request,
    to_json,
    unknown,
)
from composer.dashboard.protocol.outbox import Outbox
from composer.dashboard.web.client import Client, End

_MAX_SUBSCRIPTIONS = 64
#: Operations of the connection itself.
_OWN = ("subscribe", "unsubscribe", "update", "cancel", "ping")


@dataclass(slots=True)
class _Subscription:
    channel: str
    feed: Feed
    size: int
    end: End


class Connection(Client):
    """The connection of one browser."""

    def __init__(self, dashboard: Dashboard, socket: WebSocket) -> None:
        super().__init__(dashboard, socket, Outbox())
        self._subscriptions: dict[int, _Subscription] = {}
        self._next_subscription = 1

    def _begin(self) -> None:
        declared = self._dashboard.declared
        hello = {
            "title": self._dashboard.title,
            "file": None if declared is None else declared.file,
            "read_only": self.is_read_only,
        }
        self._outbox.reply(to_json({"hello": hello}))

    def _end(self) -> None:
        for subscription in tuple(self._subscriptions):
            self._unsubscribe(subscription)

    def _take(self, message: str | bytes) -> bool:
        identifier: int | str | None = None
        try:
            request = parse_request(message)
            identifier = request.id
            self._answer(request)
        except RequestError as error:
            self._log_refused(error)
            self.refuse(error, identifier)
        except Exception as error:  # the browser gets an answer in any case
            self.refuse(internal_error("a request", error), identifier)
        return identifier is not None

    def refuse(self, error: RequestError, identifier: int | str | None = None) -> None:
        """Say why a request is refused."""
        self._outbox.reply(to_json({"id": identifier, "error": error.as_data()}))

    def _answer(self, request: ClientRequest) -> None:
        """Answer a request at once, or start the task that does. Raises RequestError."""
        check_characters(request.text, {"op": request.op, **request.values})
        values = Values(request.values, f"'{request.op:.40}'")
        if request.op in _OWN:
            result = getattr(self, f"_on_{request.op}")(values)
            self._reply(request, result)
            return
        operation = OPERATIONS.get(request.op)
        if operation is None:
            raise unknown("operation", request.op, (*OPERATIONS, *_OWN))
        if operation.changes:
            self.check_may_change(f"'{request.op}'")
        call, timeout_s = operation.prepare(values, self._dashboard)
        values.end()
        self.request(
            call,
            timeout_s,
            partial(self._reply, request),
            partial(self.refuse, identifier=request.id),
        )

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
        self._subscriptions[number] = self._attach(number, channel, parameters, feed)
        self._outbox.open(number, channel, feed.delivery)
        return {"sub": number}

    def _on_update(self, values: Values) -> dict[str, Any]:
        number, parameters = self._number(values), values.mapping("params")
        values.end()
        before = self._subscriptions[number]
        feed = self._feed(before.channel, parameters)
        # The new feed is attached first, so that shared subscriptions continue.
        self._subscriptions[number] = self._attach(number, before.channel, parameters, feed)
        self._leave(before)
        return {}

    def _on_unsubscribe(self, values: Values) -> dict[str, Any]:
        number = self._number(values)
        values.end()
        self._unsubscribe(number)
        return {}

    def _on_cancel(self, values: Values) -> dict[str, Any]:
        number = self._number(values)
        values.end()
        self.check_may_change("'cancel'")
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
            raise unknown("channel", channel, CHANNELS)
        values = Values(parameters, f"'params' of '{channel}'")
        feed = feed_class(values, self._dashboard.declared)
        values.end()
        if feed.changes:
            self.check_may_change(f"'{channel}'")
        return feed

    def _attach(self, number: int, channel: str, parameters: Any, feed: Feed) -> _Subscription:
        """Send the updates of a feed, or of the same one that runs already, to the browser."""
        key = f"{channel} {to_json(parameters)}"
        size = 2 * len(key)  # its parameters are kept as values and as text
        self._outbox.budget.take(size)
        end = self.start(key, feed, lambda update: self._outbox.put(number, update))
        return _Subscription(channel, feed, size, end)

    def _unsubscribe(self, number: int) -> None:
        subscription = self._subscriptions.pop(number)
        self._outbox.close(number)
        self._leave(subscription)

    def _leave(self, subscription: _Subscription) -> None:
        subscription.end()
        self._outbox.budget.give(subscription.size)
