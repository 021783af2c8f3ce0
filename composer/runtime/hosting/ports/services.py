"""Services and their clients that a class creates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import count
from typing import Any, Generic, TypeVar

from rclpy.client import Client
from rclpy.node import Node
from rclpy.service import Service
from rclpy.task import Future as RclpyFuture

from composer.behavior import CallCancelled
from composer.model import Port, PortKind
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.executors.futures import Future
from composer.runtime.executors.sources import complete_request
from composer.runtime.hosting.instance import Instance, is_reentrant
from composer.runtime.hosting.user_code import UserFunction, fail
from composer.runtime.intra_process.servers import LocalService
from composer.runtime.intra_process.taps import CallTap
from composer.runtime.ports import RunningPort
from composer.runtime.ports.services import ServicePort

S = TypeVar("S")


class HostedService(ServicePort):
    """A service port around rclpy's service, with the callback of the class."""

    def __init__(self, instance: Instance, service: Service) -> None:
        port = instance.ports.port(PortKind.SERVICE, service.service_name, service.srv_type)
        self._instance = instance
        self.port = port
        self._given: Any = service
        context = instance.context_of(port, self._given)
        callback = instance.function(service.callback, service, context)
        if is_reentrant(context):
            port = replace(port, reentrant=True)
        super().__init__(context, port, None, callback)

    def _interface(self, _port: Port) -> Any:
        return self._given.srv_type

    def _make_service(self, _port: Port) -> Service:
        return self._given  # type: ignore[no-any-return]

    def _destroy_service(self) -> None:
        Node.destroy_service(self._instance.node, self._given)


class ServerInProcess(Generic[S]):
    """The server of a client within this process, which may come and go."""

    def __init__(self, context: NodeContext, port: Port, find: Callable[[], S | None]) -> None:
        self._context = context
        self._port = port
        self._find = find
        self._is_isolated = context.loop.clock.is_isolated
        #: Returns the number of a request that stays in the process. Numbers of rcl are positive.
        self.next_number: Callable[[], int] = count(-1, -1).__next__

    def for_request(self) -> S | None:
        """Return the server for a request, or None if there may be one outside."""
        server = self._find()
        if server is None and self._is_isolated:
            self._context.log.warn(
                f"{self._port.kind} '{self._port.name}' waits without end: in virtual time,"
                f" no node of the system has a server of {self._port.full_name}"
            )
        return server

    def is_ready(self, is_ready_outside: Callable[[], bool]) -> bool:
        """Return whether there is a server."""
        return self._find() is not None or (not self._is_isolated and is_ready_outside())


class HostedClient(Client):
    """The client that the class uses: rclpy's object, with this class in place of its own.

    It calls in every transition and while the node is active.
    """

    _instance: Instance
    _port: ClientPort

    def call_async(self, request: Any) -> HostedFuture:
        """Send a request; the future fails with CallCancelled if the node is not active."""
        gate = self._instance.context.gate
        if not gate.waiting:
            return hosted_future(self._instance, CallCancelled(gate.refusal))
        server = self._port.server.for_request()
        if server is None:
            future: Any = self._port.tap.follow(request, super().call_async(request))
        else:
            future = self._call_local(server, request)
        future.__class__ = HostedFuture
        future._instance = self._instance
        return future  # type: ignore[no-any-return]

    def _call_local(self, server: LocalService, request: Any) -> Any:
        expected: Any = self.srv_type.Request  # type: ignore[attr-defined]  # wrong in rclpy
        if not isinstance(request, expected):
            raise TypeError(f"Expected {expected}, got {type(request)}")
        number = self._port.server.next_number()
        future: Any = RclpyFuture()
        with self._lock:
            self._pending_requests[number] = future
        future.add_done_callback(self.remove_pending_request)
        response = future._response = Future()  # the service refers to it weakly
        response.add_done_callback(partial(self._complete, number))
        server.call(request, response)
        return future

    def _complete(self, number: int, response: Future[Any]) -> None:
        # As by DDS, a request that is refused has no response.
        if response.exception() is None:
            executor = self._instance.context.node.executor
            complete_request(self, executor, number, response.result())

    def service_is_ready(self) -> bool:
        """Return whether there is a server."""
        return self._port.server.is_ready(super().service_is_ready)

    def wait_for_service(self, timeout_sec: float | None = None) -> bool:
        """Wait for a server; return whether there is one."""
        return self._instance.wait_for_server(self.service_is_ready, timeout_sec)

    def call(self, request: Any, timeout_sec: float | None = None) -> Any:
        """Send a request and wait for the response, or return None after ``timeout_sec``."""
        future = self.call_async(request)
        if not self._instance.wait_for(future, timeout_sec):
            self.remove_pending_request(future)
            return None
        return future.result()


class HostedFuture(RclpyFuture):
    """The future of a call: rclpy's object, with this class in place of its own.

    Exceptions of its callbacks are errors of the node.
    """

    _instance: Instance

    def add_done_callback(self, callback: Callable[[Any], Any]) -> None:
        """Call ``callback(self)`` on the loop once the future is done."""
        function = UserFunction(self._instance, callback)
        context = self._instance.context

        def call(future: Any) -> None:
            rest = context.call(function.__name__, function, future)
            if rest is not None:
                context.spawn(rest)

        super().add_done_callback(call)


def hosted_future(instance: Instance, error: BaseException) -> HostedFuture:
    """Return a future that has failed with ``error``."""
    future = HostedFuture()
    future._instance = instance
    fail(future, error)
    return future


class ClientPort(RunningPort):
    """The port of a client: it fails the pending calls when the node leaves *active*."""

    def __init__(self, instance: Instance, client: Any) -> None:
        self._instance = instance
        self._client = client
        self.port = instance.ports.port(PortKind.CLIENT, client.service_name, client.srv_type)
        find = instance.context.router.service_lookup(self.port)
        self.server = ServerInProcess(instance.context, self.port, find)
        clock, recorder = instance.context.loop.clock, instance.context.router.recorder
        self.tap = CallTap.of_port(recorder, self.port, client.srv_type, clock, is_client=True)
        client.__class__ = HostedClient
        client._instance = instance
        client._port = self
        instance.context.loop.add_client(client)

    def deactivate(self) -> None:
        """Fail the pending calls."""
        gate = self._instance.context.gate
        for future in tuple(self._client._pending_requests.values()):
            future._set_executor(self._instance.context.node.executor)
            fail(future, CallCancelled(gate.refusal))

    def destroy(self) -> None:
        """Fail the pending calls and destroy the client."""
        self.deactivate()
        self._instance.context.loop.remove(self._client)
        Node.destroy_client(self._instance.node, self._client)
