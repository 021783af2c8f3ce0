"""Services and clients that a class creates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from rclpy.client import Client
from rclpy.node import Node
from rclpy.service import Service
from rclpy.task import Future

from composer.behavior import CallCancelled
from composer.model import Port, PortKind
from composer.runtime.hosting.instance import Instance, is_reentrant
from composer.runtime.hosting.user_code import UserFunction
from composer.runtime.ports import RunningPort
from composer.runtime.ports.service import ServicePort


class HostedService(ServicePort):
    """A service port around rclpy's service, with the callback of the class."""

    def __init__(self, instance: Instance, service: Service) -> None:
        port = instance.ports.port(PortKind.SERVICE, service.service_name, service.srv_type)
        self._instance = instance
        self.port = port
        self._given: Any = service
        callback = UserFunction(instance, service.callback)
        context = instance.context_of(port, self._given)
        if is_reentrant(context):
            port = replace(port, reentrant=True)
        super().__init__(context, port, None, callback)

    def destroy(self) -> None:
        """Refuse the pending requests and destroy the service."""
        self._instance.ports.forget(self.port)
        super().destroy()

    def _interface(self, _port: Port) -> Any:
        return self._given.srv_type

    def _make_service(self, _port: Port) -> Service:
        return self._given  # type: ignore[no-any-return]

    def _destroy_service(self) -> None:
        Node.destroy_service(self._instance.node, self._given)


class HostedClient(Client):
    """The client that the class uses: rclpy's, whose class is replaced by this one.

    It calls in every transition and while the node is active.
    """

    _instance: Instance

    def call_async(self, request: Any) -> HostedFuture:
        """Send a request; the future fails with CallCancelled if the node is not active."""
        gate = self._instance.context.gate
        if not gate.waiting:
            return hosted_future(self._instance, CallCancelled(gate.refusal))
        future: Any = super().call_async(request)
        future.__class__ = HostedFuture
        future._instance = self._instance
        return future  # type: ignore[no-any-return]

    def call(self, request: Any, timeout_sec: float | None = None) -> Any:
        """Send a request and wait for the response, or return None after ``timeout_sec``."""
        future = self.call_async(request)
        if not self._instance.wait_for(future, timeout_sec):
            self.remove_pending_request(future)
            return None
        return future.result()


class HostedFuture(Future):
    """The future of a call: rclpy's, whose class is replaced by this one.

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


def fail(future: Future, error: BaseException) -> None:
    """Fail a future. rclpy prints exceptions that are never retrieved; this one need not be."""
    future.set_exception(error)
    future.exception()


class ClientPort(RunningPort):
    """The port of a client: it fails the pending calls when the node leaves *active*."""

    def __init__(self, instance: Instance, client: Any) -> None:
        self._instance = instance
        self._client = client
        self.port = instance.ports.port(PortKind.CLIENT, client.service_name, client.srv_type)
        client.__class__ = HostedClient
        client._instance = instance
        instance.context.loop.add_client(client)

    def deactivate(self) -> None:
        """Fail the pending calls."""
        gate = self._instance.context.gate
        for future in tuple(self._client._pending_requests.values()):
            future._set_executor(self._instance.context.node.executor)
            fail(future, CallCancelled(gate.refusal))

    def destroy(self) -> None:
        """Fail the pending calls and destroy the client."""
        self._instance.ports.forget(self.port)
        self.deactivate()
        self._instance.context.loop.remove(self._client)
        Node.destroy_client(self._instance.node, self._client)
