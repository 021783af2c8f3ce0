"""The publisher port."""

from __future__ import annotations

from typing import Any, cast

from rclpy.event_handler import PublisherEventCallbacks

from composer.model import Port
from composer.runtime.core import Core
from composer.runtime.messages import interface_class
from composer.runtime.ports.profiles import rclpy_profile
from composer.runtime.ports.qos_events import QosEvents


class PublisherPort:
    """Publishes while the node is active; drops, counts and says so once while it is not."""

    __slots__ = (
        "_core",
        "_gate",
        "_leave",
        "_mutations",
        "_name",
        "_publisher",
        "_qos_events",
        "_send",
        "_statistics",
        "_warned",
        "message_type",
        "sent",
    )

    def __init__(self, core: Core, port: Port) -> None:
        self._core = core
        self._gate = core.gate
        self._statistics = core.statistics
        self._mutations = core.mutations
        self._name = port.name.value
        self.message_type: Any = interface_class(port.interface.value)
        self._qos_events = QosEvents(core, port)
        self._publisher = core.node.create_publisher(
            self.message_type,
            port.full_name,
            rclpy_profile(port.qos.profile),
            callback_group=core.group,
            event_callbacks=cast(PublisherEventCallbacks, self._qos_events),
        )
        send, self._leave = core.delivery.add_publisher(port, self._publisher)
        self._send = core.chains.sending(port, send)
        self._warned = False
        self.sent = 0

    def publish(self, message: Any) -> None:
        """Send ``message``. Raises TypeError when it is not of the topic's type."""
        if not self._gate.outgoing:
            self._drop()
            return
        self._send(message)
        if self._mutations is not None:
            self._mutations.remember(message, f"published by '{self._name}'")
        self.sent += 1
        self._statistics.sent += 1

    def activate(self) -> None:
        """Warn again at the next message that is dropped."""
        self._warned = False

    def deactivate(self) -> None:
        """Nothing waits in a publisher."""

    def destroy(self) -> None:
        """Leave the topic."""
        self._qos_events.close()
        self._leave()
        self._core.node.destroy_publisher(self._publisher)

    def _drop(self) -> None:
        self._statistics.dropped += 1
        if not self._warned:
            self._warned = True
            reason = self._gate.refusal
            self._core.log.warn(f"publisher '{self._name}' drops its messages: {reason}")
