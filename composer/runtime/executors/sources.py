"""The sources of subscriptions, services, clients and QoS events.

Together with ``actions`` and ``readiness``, everything that uses rclpy's internals.

QoS events are counted from rcl's callbacks, which needs only the number that a ``Signal`` carries.
Taking a status is another matter: with rmw_fastrtps of Jazzy, ``take_event`` can deadlock while the
middleware reports the next event. So a status is taken only when one is certain to be available,
and everything is watched as soon as the endpoint exists. See docs/decisions/0011-fast-dds.md.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Coroutine
from enum import IntEnum
from functools import partial
from math import inf
from typing import Any, Protocol

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.subscription import Subscription

from composer.runtime.executors.readiness import (
    EVENT,
    MESSAGE,
    REQUEST,
    RESPONSE,
    EntitySource,
    Signal,
    SourceGroup,
)
from composer.runtime.executors.scheduler import Scheduler
from composer.runtime.executors.tasks import name_of

RunTask = Callable[[Coroutine[Any, Any, Any]], object]
#: A message and the middleware's information about it.
Taken = tuple[Any, Any]

# Some of rclpy's own type hints are wrong (a service's type has no Request): hence Any below.


class Reply(Protocol):
    """Ends one request, once."""

    def __call__(self, response: Any, /) -> None:
        """Send the response."""

    def refuse(self, error: BaseException) -> None:
        """Send no response; a caller in this process gets the error."""


def unused_callback(_: Any, response: Any) -> Any:
    """Satisfy rclpy, which requires a service callback; the loop calls another one."""
    return response


class SubscriptionSource(EntitySource):
    """Calls ``callback((message, information))`` for each message."""

    __slots__ = ("_subscription", "call", "take")
    may_skip = False

    def __init__(self, subscription: Subscription, callback: Callable[[Taken], object]) -> None:
        super().__init__(subscription.handle, MESSAGE)
        self._subscription = subscription
        # Attributes, not methods: called per message, without a frame in between.
        self.call: Callable[[Taken], object] = callback
        self.take: Callable[[], Taken | None] = partial(
            subscription.handle.take_message, subscription.msg_type, subscription.raw
        )

    @property
    def name(self) -> str:
        """The topic and the callback."""
        return f"subscription '{self._subscription.topic}' ({name_of(self.call)})"


class ServiceSource(EntitySource):
    """Calls ``callback(request, reply)`` for each request."""

    may_skip = False

    def __init__(self, service: Any, callback: Callable[[Any, Reply], object]) -> None:
        super().__init__(service.handle, REQUEST)
        self._service = service
        self._callback = callback

    @property
    def name(self) -> str:
        """The service and the callback."""
        return f"service '{self._service.srv_name}' ({name_of(self._callback)})"

    def take(self) -> Any:
        """Return a request and its header."""
        service = self._service
        request, header = service.handle.service_take_request(service.srv_type.Request)
        return None if header is None else (request, header)

    def call(self, taken: Any) -> None:
        """Call back with the request. If that raises, the client gets an empty response."""
        request, header = taken
        reply = SingleReply(self._service, header)
        try:
            self._callback(request, reply)
        except BaseException:
            reply.send_empty()
            raise


class SingleReply:
    """Responds to one request, once."""

    __slots__ = ("_header", "_service")

    def __init__(self, service: Any, header: object) -> None:
        self._service = service
        self._header: object = header

    def __call__(self, response: Any) -> None:
        """Send the response.

        Raises TypeError for another type than the service's response, RuntimeError if there was a
        response already.
        """
        if self._header is None:
            raise RuntimeError(f"service '{self._service.srv_name}': already answered")
        self._service.send_response(response, self._header)
        self._header = None

    def refuse(self, _: BaseException) -> None:
        """Send no response: by DDS, there is no other way to say that there is no result."""
        self._header = None

    def send_empty(self) -> None:
        """Send an empty response, unless there was one."""
        if self._header is not None:
            self(self._service.srv_type.Response())


def rclpy_callback(service: Any, run_task: RunTask) -> Callable[[Any, Reply], None]:
    """Return a function that calls ``service.callback``, as given to ``node.create_service``."""

    async def respond(request: Any, reply: Any) -> None:
        try:
            reply(await service.callback(request, service.srv_type.Response()))
        except BaseException:
            reply.send_empty()
            raise

    def call(request: Any, reply: Reply) -> None:
        if inspect.iscoroutinefunction(service.callback):
            run_task(respond(request, reply))
        else:
            reply(service.callback(request, service.srv_type.Response()))

    return call


class ClientSource(EntitySource):
    """Completes the futures of ``client.call_async``."""

    may_skip = True

    def __init__(self, client: Any, executor: object) -> None:
        super().__init__(client.handle, RESPONSE)
        self._client = client
        self._executor = executor

    @property
    def name(self) -> str:
        """The service."""
        return f"client of '{self._client.srv_name}'"

    def take(self) -> Any:
        """Return a response and its header."""
        header, response = self._client.handle.take_response(self._client.srv_type.Response)
        return None if header is None else (header, response)

    def call(self, taken: Any) -> None:
        """Complete the future of the request, unless it was removed."""
        header, response = taken
        complete_request(self._client, self._executor, header.request_id.sequence_number, response)


def complete_request(client: Any, executor: object, number: int, response: Any) -> None:
    """Complete the future of a client's request, unless it was removed."""
    try:
        future = client.get_pending_request(number)
    except KeyError:
        return
    future._set_executor(executor)  # the loop reports exceptions of done callbacks
    future.set_result(response)


class EventCounts:
    """The QoS events of all publishers and subscriptions of a process. Any thread may call.

    ``endpoint`` is rclpy's handle of a publisher or a subscription; stop watching before it is
    destroyed. Every method raises rclpy's UnsupportedEventTypeError.
    """

    def __init__(self, loop: Scheduler) -> None:
        """``loop`` makes the calls, whatever loops the nodes have."""
        self._loop = loop

    def watch(
        self, endpoint: Any, kind: IntEnum, on_event: Callable[[], None]
    ) -> Callable[[], None]:
        """Call ``on_event`` for each event of ``kind``; return a function that stops that."""
        group = self._loop.add_group(_CountSource(endpoint, kind, on_event))
        return lambda: self._loop.remove_group(group)

    def watch_status(
        self, endpoint: Any, kind: IntEnum, on_status: Callable[[Any], None]
    ) -> Callable[[], None]:
        """Call ``on_status`` after events of ``kind``; return a function that stops that.

        One status may cover several events. An event that occurs while the last status is being
        taken is reported with the next one.
        """
        source = _StatusSource(endpoint, kind, on_status)
        group = self._loop.add_group(source)
        self._loop.call_soon(lambda: source.begin(group))
        return lambda: self._loop.remove_group(group)


class _EventSource(EntitySource):
    """One kind of event of an endpoint. A group signals a new source once by itself."""

    may_skip = True

    def __init__(self, endpoint: Any, kind: IntEnum, callback: Callable[..., None]) -> None:
        with endpoint:
            self._event = rclpy_implementation.EventHandle(endpoint, kind)
        super().__init__(self._event, EVENT)
        self._callback = callback
        self._kind = kind

    @property
    def name(self) -> str:
        """The kind of event."""
        return self._kind.name

    def detach(self, signal: Signal) -> None:
        """Signal nothing more, and release the event."""
        super().detach(signal)
        self._event.destroy_when_not_in_use()


class _CountSource(_EventSource):
    """Calls back for each signaled event."""

    def __init__(self, endpoint: Any, kind: IntEnum, on_event: Callable[[], None]) -> None:
        super().__init__(endpoint, kind, on_event)
        self._is_first = True

    def take(self) -> bool | None:
        """Return true for each signal but the first, which is the signal of the group."""
        if self._is_first:
            self._is_first = False
            return None
        return True

    def call(self, _: bool) -> None:
        """Call back."""
        self._callback()


class _StatusSource(_EventSource):
    """Calls back with the status of signaled events.

    ``take`` is called once per signal. Events that were signaled before a status was taken may be
    part of it, and are skipped.
    """

    def __init__(self, endpoint: Any, kind: IntEnum, on_status: Callable[[Any], None]) -> None:
        super().__init__(endpoint, kind, on_status)
        self._to_skip: float = inf  # number of signals to skip; all of them until it begins

    def begin(self, group: SourceGroup) -> None:
        """Take the status of events from now on. Call it on the loop."""
        self._group = group
        self._to_skip = group.due + self._count_uncounted()

    def take(self) -> Any:
        """Return the status, or None for a skipped signal."""
        if self._to_skip:
            self._to_skip -= 1
            return None
        status = self._event.take_event()
        self._to_skip = self._group.due - 1 + self._count_uncounted()
        return status

    def call(self, status: Any) -> None:
        """Call back with the status."""
        self._callback(status)

    def _count_uncounted(self) -> int:
        """Return how many signals the loop has not counted yet."""
        signal = self._group.signal
        count = signal.count()
        if count:
            signal.write(count)
        return count
