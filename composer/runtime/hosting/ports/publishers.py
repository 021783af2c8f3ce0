"""Publishers that a class creates."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

from rclpy.lifecycle.publisher import LifecyclePublisher
from rclpy.node import Node
from rclpy.publisher import Publisher

from composer.model import Port, PortKind
from composer.model.qos import Durability
from composer.runtime.hosting.instance import Instance
from composer.runtime.hosting.ports.qos_events import HostedQosEvents, PendingQosEvents
from composer.runtime.hosting.user_code import UserFunction
from composer.runtime.intra_process.copying import copy_of
from composer.runtime.ports.publisher import PublisherPort
from composer.runtime.ports.qos_events import QosEvents


class HostedPublisher(PublisherPort):
    """A publisher port around rclpy's publisher, which the class uses.

    Messages that are published while the node is not active are dropped. Those of a transient-local
    topic are kept and sent on activation: a class may publish one in its constructor, once.
    """

    def __init__(self, instance: Instance, publisher: Publisher, events: PendingQosEvents) -> None:
        port = instance.ports.port(
            PortKind.PUBLISHER, publisher.topic_name, publisher.msg_type, publisher.qos_profile
        )
        self._instance = instance
        self.port = port
        self._given = publisher
        self._callbacks = {
            kind: UserFunction(instance, callback)
            for kind, callback in events.callbacks(PortKind.PUBLISHER).items()
        }
        self._held: deque[Any] = deque(maxlen=port.qos.profile.queue_depth)
        super().__init__(instance.context_of(port, publisher), port)
        # An attribute of the object hides the method of the class at no cost per call.
        publisher.publish = self._publish_function()  # type: ignore[method-assign, assignment]

    def activate(self) -> None:
        """Send the messages that were kept."""
        super().activate()
        while self._held:
            self.gated.publish(self._held.popleft())

    def destroy(self) -> None:
        """Destroy the publisher."""
        self._instance.ports.forget(self.port)
        super().destroy()

    def _publish_function(self) -> Callable[[Any], None]:
        publish = self.gated.publish
        if self.port.qos.profile.durability is Durability.TRANSIENT_LOCAL:
            publish = self._publish_or_keep
        publisher = self._given
        if not isinstance(publisher, LifecyclePublisher):
            return publish

        def publish_if_enabled(message: Any) -> None:
            if publisher.is_activated:
                publish(message)

        return publish_if_enabled

    def _publish_or_keep(self, message: Any) -> None:
        if self._context.gate.outgoing:
            self.gated.publish(message)
        else:
            self._held.append(message if isinstance(message, bytes) else copy_of(message))

    def _make_qos_events(self, port: Port) -> QosEvents:
        return HostedQosEvents(self._context, port, self._callbacks)

    def _make_publisher(self, _port: Port) -> Publisher:
        publisher = self._given
        self._qos_events.create_event_handlers(self._context.group, publisher.handle, "")
        return publisher

    def _destroy_publisher(self) -> None:
        Node.destroy_publisher(self._instance.node, self._given)
