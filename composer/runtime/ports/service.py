"""The service port."""

from __future__ import annotations

from typing import Any

from rclpy.service import Service

from composer.model import Port
from composer.runtime.callbacks.callback import CallbackTimer
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.reactions import RunningReaction
from composer.runtime.executors.sources import unused_callback
from composer.runtime.intra_process.servers import LocalService
from composer.runtime.intra_process.taps import CallTap
from composer.runtime.ports.serving import Handler, RequestServer
from composer.runtime.ros.conversions import rclpy_profile
from composer.runtime.ros.messages import interface_class


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
