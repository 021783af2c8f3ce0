"""The publisher port."""

from __future__ import annotations

from collections.abc import Iterator
from typing import cast

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.publisher import Publisher

from composer.model import Port
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.mutation_check import RememberingTarget
from composer.runtime.intra_process.publisher import PublisherContext, Target
from composer.runtime.ports import RunningPort
from composer.runtime.ports.qos_events import QosEvents
from composer.runtime.ros.messages import interface_class
from composer.runtime.ros.qos_profiles import rclpy_profile


class PublisherPort(RunningPort):
    """Publishes while the node is active; otherwise drops and counts messages, and warns once."""

    __slots__ = (
        "_context",
        "_count",
        "_name",
        "_publisher",
        "_qos_events",
        "_remove",
        "_warned",
        "gated",
    )

    def __init__(self, context: NodeContext, port: Port) -> None:
        self._context = context
        self._name = port.name.value
        self._qos_events = self._make_qos_events(port)
        self._publisher = self._make_publisher(port)
        origin = PublisherContext(
            context.gate,
            context.loop.clock,
            self._drop,
            tuple(self._observers(port)),
            listens_to_matches=not self._qos_events.uses_matches,
        )
        #: The publisher that the node's behavior and reactions use.
        self.gated, self._remove = context.router.add_publisher(port, self._publisher, origin)
        self._count = context.statistics.publisher(self._name)
        self._count.begin(self.gated)
        self._warned = False

    def activate(self) -> None:
        """Warn again at the next message that is dropped."""
        self._warned = False
        self._qos_events.activate()

    def destroy(self) -> None:
        """Destroy the publisher."""
        self._qos_events.close()
        self._remove()
        self._count.end()
        self._destroy_publisher()

    def _make_qos_events(self, port: Port) -> QosEvents:
        return QosEvents(self._context, port)

    def _make_publisher(self, port: Port) -> Publisher:
        return self._context.node.create_publisher(
            interface_class(port.interface.value),
            port.full_name,
            rclpy_profile(port.qos.profile),
            callback_group=self._context.group,
            event_callbacks=cast("PublisherEventCallbacks", self._qos_events),
        )

    def _destroy_publisher(self) -> None:
        self._context.node.destroy_publisher(self._publisher)

    def _observers(self, port: Port) -> Iterator[Target]:
        yield from self._qos_events.publisher_limits()
        yield from self._context.chains.published_by(port)
        if self._context.mutations is not None:
            yield RememberingTarget(self._context.mutations, f"published by '{self._name}'")

    def _drop(self) -> None:
        self._context.statistics.dropped += 1
        if not self._warned:
            self._warned = True
            reason = self._context.gate.refusal
            self._context.log.warn(f"publisher '{self._name}' drops its messages: {reason}")
