"""What a loop serves: one source an entity, each with how to take from it and whom to call.

A source takes one item at a time, so that a loop can go round them all. Kept here, in
``actions`` and in ``readiness``: everything that reaches
into rclpy.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Coroutine
from functools import partial, wraps
from typing import Any, Protocol

from rclpy.client import Client
from rclpy.event_handler import EventHandler
from rclpy.service import Service
from rclpy.subscription import Subscription
from rclpy.time_source import TimeSource

from composer.runtime.executors import readiness
from composer.runtime.executors.loop import Reply, Taken
from composer.runtime.executors.readiness import Signal
from composer.runtime.executors.tasks import name_of

RunTask = Callable[[Coroutine[Any, Any, Any]], object]

# rclpy's own type hints are in part wrong (a service's type has no Request): hence Any below.


class Source(Protocol):
    """One entity that is served.

    ``passes_over``: a take that brings nothing may be followed by one that does. A client is sent
    all answers of its service, and passes over those for others.
    """

    @property
    def passes_over(self) -> bool:
        """See above."""

    @property
    def name(self) -> str:
        """What people call it, for reports."""

    def attach(self, signal: Signal) -> None:
        """Have the entity announced by ``signal``."""

    def detach(self, signal: Signal) -> None:
        """End that."""

    def take(self) -> Any:
        """Return what is there next, or None."""

    def call(self, taken: Any, /) -> object:
        """Give what was taken to whom it is for."""


class SubscriptionSource:
    """Calls ``callback((message, information))`` for each message."""

    __slots__ = ("_subscription", "call", "take")
    passes_over = False

    def __init__(self, subscription: Subscription, callback: Callable[[Taken], object]) -> None:
        self._subscription = subscription
        # Neither is a method: they are called for each message.
        self.call: Callable[[Taken], object] = callback
        self.take: Callable[[], Taken | None] = partial(
            subscription.handle.take_message, subscription.msg_type, subscription.raw
        )

    @property
    def name(self) -> str:
        """The topic and the callback."""
        return f"subscription '{self._subscription.topic}' ({name_of(self.call)})"

    def attach(self, signal: Signal) -> None:
        """Have messages announced."""
        signal.attach(self._subscription.handle, readiness.MESSAGE)

    def detach(self, signal: Signal) -> None:
        """End that."""
        signal.detach(self._subscription.handle)


class ServiceSource:
    """Calls ``callback(request, reply)`` for each request."""

    passes_over = False

    def __init__(self, service: Any, callback: Callable[[Any, Reply], object]) -> None:
        self._service = service
        self._callback = callback

    @property
    def name(self) -> str:
        """The service and the callback."""
        return f"service '{self._service.srv_name}' ({name_of(self._callback)})"

    def attach(self, signal: Signal) -> None:
        """Have requests announced."""
        signal.attach(self._service.handle, readiness.REQUEST)

    def detach(self, signal: Signal) -> None:
        """End that."""
        signal.detach(self._service.handle)

    def take(self) -> Any:
        """Return a request and its header."""
        service = self._service
        request, header = service.handle.service_take_request(service.srv_type.Request)
        return None if header is None else (request, header)

    def call(self, taken: Any) -> None:
        """Call with the request. When the callback raises, the caller gets an empty answer."""
        request, header = taken
        reply = OneReply(self._service, header)
        try:
            self._callback(request, reply)
        except BaseException:
            reply.give_up()
            raise


class OneReply:
    """Answers one request, once."""

    __slots__ = ("_header", "_service")

    def __init__(self, service: Any, header: object) -> None:
        self._service = service
        self._header: object = header

    def __call__(self, response: Any) -> None:
        """Send the answer.

        Raises TypeError when it is not a response of the service, RuntimeError when the request
        has been answered.
        """
        if self._header is None:
            raise RuntimeError(f"service '{self._service.srv_name}': answered already")
        self._service.send_response(response, self._header)
        self._header = None

    def give_up(self) -> None:
        """Send an empty answer, unless there was one."""
        if self._header is not None:
            self(self._service.srv_type.Response())


def answer_with_own_callback(service: Any, run_task: RunTask) -> Callable[[Any, Reply], None]:
    """Return what calls ``service.callback``, as ``node.create_service`` was given it."""

    async def answer(request: Any, reply: Any) -> None:
        try:
            reply(await service.callback(request, service.srv_type.Response()))
        except BaseException:
            reply.give_up()
            raise

    def call(request: Any, reply: Reply) -> None:
        if inspect.iscoroutinefunction(service.callback):
            run_task(answer(request, reply))
        else:
            reply(service.callback(request, service.srv_type.Response()))

    return call


class ClientSource:
    """Completes the futures of ``client.call_async``."""

    passes_over = True

    def __init__(self, client: Any, executor: object) -> None:
        self._client = client
        self._executor = executor

    @property
    def name(self) -> str:
        """The service."""
        return f"client of '{self._client.srv_name}'"

    def attach(self, signal: Signal) -> None:
        """Have responses announced."""
        signal.attach(self._client.handle, readiness.RESPONSE)

    def detach(self, signal: Signal) -> None:
        """End that."""
        signal.detach(self._client.handle)

    def take(self) -> Any:
        """Return a response and its header."""
        header, response = self._client.handle.take_response(self._client.srv_type.Response)
        return None if header is None else (header, response)

    def call(self, taken: Any) -> None:
        """Complete the future of the request, unless nobody waits for it any more."""
        header, response = taken
        try:
            future = self._client.get_pending_request(header.request_id.sequence_number)
        except KeyError:
            return
        future._set_executor(self._executor)  # exceptions of done callbacks come to the loop
        future.set_result(response)


class EventSource:
    """Calls what was registered for a QoS event of a publisher or a subscription."""

    passes_over = False

    def __init__(self, handler: Any) -> None:
        self._handler = handler
        self._handle = handler._EventHandler__event
        self._seen: tuple[object, ...] = ()

    @property
    def name(self) -> str:
        """The kind of event and the callback."""
        return f"event {self._handler.event_type.name} ({name_of(self._handler.callback)})"

    def attach(self, signal: Signal) -> None:
        """Have the event announced."""
        signal.attach(self._handle, readiness.EVENT)

    def detach(self, signal: Signal) -> None:
        """End that."""
        signal.detach(self._handle)

    def take(self) -> Any:
        """Return the status, unless nothing happened: rcl always has a status.

        Its ``..._change`` fields do not tell: attaching sets them back to nothing.
        """
        status = self._handle.take_event()
        fields = [name for name in dir(status) if name.endswith(("_count", "_count_change"))]
        counts = tuple(getattr(status, name) for name in fields)
        happened = any(counts) and counts != self._seen
        self._seen = tuple(
            0 if name.endswith("_change") else count
            for name, count in zip(fields, counts, strict=True)
        )
        return status if happened else None

    def call(self, taken: Any) -> None:
        """Call with the status."""
        self._handler.callback(taken)


def source_of(entity: object, executor: object, run_task: RunTask) -> Source | None:
    """Return what serves an entity by the callback it was created with.

    None for what is not served that way: timers, guard conditions and actions.
    """
    match entity:
        case Subscription():
            return SubscriptionSource(entity, _with_message_alone(entity.callback))
        case Service():
            return ServiceSource(entity, answer_with_own_callback(entity, run_task))
        case Client():
            return ClientSource(entity, executor)
        case EventHandler():
            return EventSource(entity)
    return None


def _with_message_alone(callback: Callable[[Any], object]) -> Callable[[Taken], object]:
    @wraps(callback)  # for the name
    def call(taken: Taken) -> object:
        return callback(taken[0])

    return call


def comes_by_itself(entity: object) -> bool:
    """Tell whether nobody adds the entity, though the node got it late: QoS events, the clock."""
    callback = getattr(entity, "callback", None)
    return isinstance(entity, EventHandler) or isinstance(
        getattr(callback, "__self__", None), TimeSource
    )
