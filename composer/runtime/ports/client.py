"""The service client port."""

from __future__ import annotations

from typing import Any

from composer.behavior import CallCancelled, CallError
from composer.model import Event, Port
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.executors.futures import Future, wrap_future
from composer.runtime.intra_process.servers import LocalService
from composer.runtime.ports.calls import CallingPort, CallLimit
from composer.runtime.ros.messages import interface_class
from composer.runtime.ros.qos_profiles import rclpy_profile


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

    def send(self, content: Any) -> None:
        """Send a request for a reaction; failures without ``on_failure`` are logged."""
        self._context.spawn(self._send(content))

    def deactivate(self) -> None:
        """Do nothing: the gate cancels the pending calls."""

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
        return self._client.call_async(request)

    async def _send(self, request: Any) -> None:
        try:
            await self._call(request, self._timeout_ms)
        except CallError as error:
            self._on_failure(error)
