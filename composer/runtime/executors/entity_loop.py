"""How loops of every kind serve subscriptions, services, clients and actions."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import Any

from rclpy.action.client import ActionClient
from rclpy.action.server import ActionServer
from rclpy.client import Client
from rclpy.service import Service
from rclpy.subscription import Subscription

from composer.runtime.executors.base_loop import BaseLoop
from composer.runtime.executors.entities.actions import ActionSource, contain_exceptions
from composer.runtime.executors.entities.source_group import EntitySource
from composer.runtime.executors.entities.sources import (
    ClientSource,
    ServiceSource,
    SubscriptionSource,
)
from composer.runtime.executors.loop import Reply, Taken


class EntityLoop(BaseLoop):
    """Creates the source of each entity that is added."""

    @property
    @abstractmethod
    def _rclpy_executor(self) -> object:
        """The executor that runs the done callbacks of rclpy's futures."""

    @abstractmethod
    def _serve(self, entity: object, source: EntitySource) -> None:
        """Serve ``entity`` by ``source`` from now on."""

    def add_subscription(
        self, subscription: Subscription, callback: Callable[[Taken], None]
    ) -> None:
        """Call ``callback((message, information))`` for each message."""
        self._serve(subscription, SubscriptionSource(subscription, callback))

    def add_service(self, service: Service, callback: Callable[[Any, Reply], None]) -> None:
        """Call ``callback(request, reply)``; ``reply(response)`` responds, now or later."""
        self._serve(service, ServiceSource(service, callback))

    def add_client(self, client: Client) -> None:
        """Complete the futures of ``client.call_async``."""
        self._serve(client, ClientSource(client, self._rclpy_executor))

    def add_action_server(self, server: ActionServer) -> None:
        """Handle the server's goal, cancel and result requests."""
        contain_exceptions(server, self.report)
        self._serve(server, ActionSource(server, self._rclpy_executor, self))

    def add_action_client(self, client: ActionClient) -> None:
        """Complete the futures of the client and deliver its feedback."""
        self._serve(client, ActionSource(client, self._rclpy_executor, self))
