"""The sources of subscriptions, services and clients.

Together with ``actions`` and ``readiness``, everything that uses rclpy's internals.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Coroutine
from functools import partial
from typing import Any, Protocol

from rclpy.subscription import Subscription

from composer.runtime.executors import readiness
from composer.runtime.executors.readiness import Signal
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


class SubscriptionSource:
    """Calls ``callback((message, information))`` for each message."""

    __slots__ = ("_subscription", "call", "take")
    may_skip = False

    def __init__(self, subscription: Subscription, callback: Callable[[Taken], object]) -> None:
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

    def attach(self, signal: Signal) -> None:
        """Signal messages."""
        signal.attach(self._subscription.handle, readiness.MESSAGE)

    def detach(self, signal: Signal) -> None:
        """Stop that."""
        signal.detach(self._subscription.handle)


class ServiceSource:
    """Calls ``callback(request, reply)`` for each request."""

    may_skip = False

    def __init__(self, service: Any, callback: Callable[[Any, Reply], object]) -> None:
        self._service = service
        self._callback = callback

    @property
    def name(self) -> str:
        """The service and the callback."""
        return f"service '{self._service.srv_name}' ({name_of(self._callback)})"

    def attach(self, signal: Signal) -> None:
        """Signal requests."""
        signal.attach(self._service.handle, readiness.REQUEST)

    def detach(self, signal: Signal) -> None:
        """Stop that."""
        signal.detach(self._service.handle)

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


class ClientSource:
    """Completes the futures of ``client.call_async``."""

    may_skip = True

    def __init__(self, client: Any, executor: object) -> None:
        self._client = client
        self._executor = executor

    @property
    def name(self) -> str:
        """The service."""
        return f"client of '{self._client.srv_name}'"

    def attach(self, signal: Signal) -> None:
        """Signal responses."""
        signal.attach(self._client.handle, readiness.RESPONSE)

    def detach(self, signal: Signal) -> None:
        """Stop that."""
        signal.detach(self._client.handle)

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
