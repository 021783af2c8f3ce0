"""Services, their clients, and what these have in common with action clients.

Clients of both kinds limit how long they wait, and send requests or goals for reactions.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from math import inf
from typing import Any, TypeVar

from rclpy.service import Service

from composer.behavior import CallCancelled, CallError, CallTimeout, ServerUnavailable
from composer.model import Event, Port
from composer.runtime.callbacks.callback import CallbackTimer
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.reactions import RunningReaction
from composer.runtime.executors.futures import Future, wrap_future
from composer.runtime.executors.sources import unused_callback
from composer.runtime.executors.tasks import sleep
from composer.runtime.executors.tracebacks import text_of
from composer.runtime.intra_process.servers import LocalService
from composer.runtime.intra_process.taps import CallTap
from composer.runtime.ports import RunningPort
from composer.runtime.ports.serving import Handler, RequestServer
from composer.runtime.ros.conversions import rclpy_profile
from composer.runtime.ros.messages import interface_class

T = TypeVar("T")

#: rclpy does not notify when a server appears; polling costs microseconds.
_POLL_PERIOD_S = 0.01


class ServicePort(RequestServer):
    """A server with a service of rclpy."""

    _context: NodeContext

    def __init__(
        self,
        context: NodeContext,
        port: Port,
        reaction: RunningReaction | None,
        handler: Handler | None,
    ) -> None:
        statistics = context.statistics.callback(port.kind.value, port.name.value)
        timer = CallbackTimer(context, statistics, port.budget_ms)
        super().__init__(context, port, self._interface(port), handler, timer)
        self._react = None if reaction is None else reaction.run
        self._service = self._make_service(port)
        tap = CallTap.of_port(context.router.recorder, port, self._type, context.loop.clock)
        receive = tap.recorded(self.on_request)
        context.loop.add_service(self._service, receive)
        local = LocalService(
            port.full_name, self._type, context.loop.call_soon, receive, port.isolation
        )
        self._remove = context.router.add_service(port, local)

    def destroy(self) -> None:
        """Refuse the pending requests and destroy the service."""
        self._remove()
        super().destroy()
        self._context.loop.remove(self._service)
        self._destroy_service()

    def _interface(self, port: Port) -> Any:
        return interface_class(port.interface.value)

    def _make_service(self, port: Port) -> Service:
        return self._context.node.create_service(
            self._type,
            port.full_name,
            unused_callback,
            qos_profile=rclpy_profile(port.qos.profile),
            callback_group=self._context.group_of(port),
        )

    def _destroy_service(self) -> None:
        self._context.node.destroy_service(self._service)


class CallLimit:
    """Limits one call to a time, and to the node's *active* period.

    ``what`` names the call in errors, for example ``service '/plan'``.
    """

    __slots__ = ("_context", "_end_s", "_generation", "_timeout_ms", "_what")

    def __init__(self, context: NodeContext, what: str, timeout_ms: float | None) -> None:
        """Without ``timeout_ms``, the time is unlimited. Raises CallCancelled in a wrong state."""
        self._generation = context.gate.generation  # read first, so that no cancellation is missed
        if not context.gate.outgoing:
            raise CallCancelled(context.gate.refusal)
        self._context = context
        self._what = what
        self._timeout_ms = timeout_ms
        self._end_s = (
            inf
            if timeout_ms is None
            else self._context.loop.clock.monotonic() + timeout_ms / 1000.0
        )

    async def wait_for_server(self, is_available: Callable[[], bool]) -> None:
        """Wait for the server. Raises ServerUnavailable and CallCancelled."""
        while not is_available():
            if self._context.loop.clock.monotonic() >= self._end_s:
                raise ServerUnavailable(
                    f"no server of {self._what} was available within {self._timeout_ms:g} ms"
                )
            await self._limit_to(sleep(self._context.loop, _POLL_PERIOD_S), inf)

    async def wait_for_response(self, response: Any) -> Any:
        """Return the result of a future, this package's or rclpy's.

        Raises CallTimeout and CallCancelled. On a timeout the future is canceled, so that the
        client forgets the request. If the node leaves *active*, it is not: rclpy would warn of the
        late response to a forgotten request.
        """
        future = response if isinstance(response, Future) else wrap_future(response)
        try:
            return await self.limit(future)
        except CallCancelled:
            raise
        except BaseException:
            response.cancel()
            raise

    def limit(self, future: Future[T]) -> Future[T]:
        """Fail ``future`` with CallTimeout or CallCancelled unless done in time; return it."""
        return self._limit_to(future, self._end_s)

    def _limit_to(self, future: Future[T], until_s: float) -> Future[T]:
        gate = self._context.gate
        gate.pending.add(future, until_s, self._timeout_error)
        if gate.generation != self._generation:  # the node has just left *active*
            future.set_exception(CallCancelled(gate.refusal))
        return future

    def _timeout_error(self) -> CallTimeout:
        return CallTimeout(f"{self._what} did not answer within {self._timeout_ms:g} ms")


class CallingPort(RunningPort):
    """A client or action client port."""

    def __init__(self, context: NodeContext, port: Port, what: str) -> None:
        """Create a port; ``what`` is its server's kind in errors: ``service`` or ``action``."""
        self._context = context
        self._name = port.name.value
        self._label = f"{port.kind} '{self._name}'"
        self._what = f"{what} '{port.full_name}'"
        self._timeout_ms = port.call_timeout_ms
        self._reactions: dict[Event, RunningReaction] = {}
        statistics = context.statistics.callback(port.kind.value, self._name)
        self._timer = CallbackTimer(context, statistics, port.budget_ms)
        self._run = self._timer.wrap(self._run_reaction)

    def react(self, event: Event, reaction: RunningReaction) -> None:
        """Run ``reaction`` on each ``event`` of the port, such as a response or a failure."""
        self._reactions[event] = reaction

    def send(self, content: Any) -> None:
        """Send a request or a goal for a reaction; failures without ``on_failure`` are logged."""
        self._context.spawn(self._send(content))

    @abstractmethod
    async def _complete(self, content: Any) -> None:
        """Send a request or a goal, and wait until it has ended. Raises CallError."""

    async def _send(self, content: Any) -> None:
        try:
            await self._complete(content)
        except CallError as error:
            self._on_failure(error)

    def _check_type(self, content: Any, content_type: Any, expected: str) -> None:
        if not isinstance(content, content_type):
            raise TypeError(f"{self._label} takes a {expected}, not {type(content).__name__}")

    def _on_failure(self, error: BaseException) -> None:
        """Log a failed call that no reaction handles."""
        if isinstance(error, CallCancelled):
            self._context.log.debug(f"{self._label}: {text_of(error)}")
        elif Event.FAILURE not in self._reactions:
            self._context.error_log.error(self._label, text_of(error))

    def _react(self, event: Event, **values: Any) -> None:
        reaction = self._reactions.get(event)
        if reaction is not None and self._context.gate.incoming:
            self._context.strand.post(lambda: self._run((reaction, event, values)))

    def _run_reaction(self, item: tuple[RunningReaction, Event, dict[str, Any]]) -> None:
        reaction, event, values = item
        try:
            reaction.run(**values)
        except Exception as error:
            self._context.error_log.exception(f"{self._label} on_{event}", error)


class ClientPort(CallingPort):
    """Calls a service. Responses go to the caller and to the port's own reactions."""

    def __init__(self, context: NodeContext, port: Port) -> None:
        super().__init__(context, port, "service")
        self._find_server = context.router.service_lookup(port)
        self.service_type: Any = interface_class(port.interface.value)
        self._client = context.node.create_client(
            self.service_type,
            port.full_name,
            qos_profile=rclpy_profile(port.qos.profile),
            callback_group=context.group,
        )
        context.loop.add_client(self._client)
        self._tap = CallTap.of_port(
            context.router.recorder, port, self.service_type, context.loop.clock, is_client=True
        )

    @property
    def content_type(self) -> Any:
        """The class of requests."""
        return self.service_type.Request

    def call(self, request: Any, *, timeout_ms: float | None = None) -> Future[Any]:
        """Send ``request`` now; return the future of the response.

        It fails with ServerUnavailable, CallTimeout or CallCancelled. Raises TypeError.
        """
        self._check_type(request, self.content_type, f"{self.service_type.__name__}.Request")
        limit_ms = self._timeout_ms if timeout_ms is None else timeout_ms
        server = self._find_server()
        if server is None or self._reactions:
            called = self._context.spawn(self._call(request, limit_ms))
            return wrap_future(called, self._on_failure)
        return self._call_local(server, request, limit_ms)

    def destroy(self) -> None:
        """Destroy the client."""
        self._context.loop.remove(self._client)
        self._context.node.destroy_client(self._client)

    def _call_local(self, server: LocalService, request: Any, timeout_ms: float) -> Future[Any]:
        """Call a server of the process: it only waits for the response, which needs no task."""
        response: Future[Any] = Future(self._on_failure)
        try:
            limit = CallLimit(self._context, self._what, timeout_ms)
        except CallCancelled as error:
            response.set_exception(error)
            return response
        self._context.statistics.calls += 1
        server.call(request, limit.limit(response))
        return response

    async def _call(self, request: Any, timeout_ms: float) -> Any:
        try:
            limit = CallLimit(self._context, self._what, timeout_ms)
            await limit.wait_for_server(self._has_server)
            self._context.statistics.calls += 1
            response = await limit.wait_for_response(self._send_request(request))
        except CallError as error:
            self._react(Event.FAILURE, failure=str(error))
            raise
        self._react(Event.RESPONSE, response=response, request=request)
        return response

    def _has_server(self) -> bool:
        return self._find_server() is not None or self._client.service_is_ready()

    def _send_request(self, request: Any) -> Any:
        """Send ``request``; return the future of the response, this package's or rclpy's."""
        server = self._find_server()
        if server is not None:
            response: Future[Any] = Future()
            server.call(request, response)
            return response
        return self._tap.follow(request, self._client.call_async(request))

    async def _complete(self, content: Any) -> None:
        await self._call(content, self._timeout_ms)
