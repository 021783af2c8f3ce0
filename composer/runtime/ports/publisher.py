"""The publisher port."""

from __future__ import annotations

from collections.abc import Iterator
from typing import cast

from rclpy.event_handler import PublisherEventCallbacks

from composer.model import Port
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.mutation_check import Remembered
from composer.runtime.intra_process.publisher import Origin, Target
from composer.runtime.ports.qos_events import QosEvents
from composer.runtime.ros.messages import interface_class
from composer.runtime.ros.qos_profiles import rclpy_profile


class PublisherPort:
    """Publishes while the node is active; drops, counts and says so once while it is not."""

    __slots__ = (
        "_core",
        "_leave",
        "_name",
        "_publisher",
        "_qos_events",
        "_tally",
        "_warned",
        "sender",
    )

    def __init__(self, core: NodeContext, port: Port) -> None:
        self._core = core
        self._name = port.name.value
        self._qos_events = QosEvents(core, port)
        self._publisher = core.node.create_publisher(
            interface_class(port.interface.value),
            port.full_name,
            rclpy_profile(port.qos.profile),
            callback_group=core.group,
            event_callbacks=cast(PublisherEventCallbacks, self._qos_events),
        )
        origin = Origin(core.gate, self._drop, tuple(self._watchers(port)))
        #: What the node publishes with.
        self.sender, self._leave = core.delivery.add_publisher(port, self._publisher, origin)
        self._tally = core.statistics.publisher(self._name)
        self._tally.begin(self.sender)
        self._warned = False

    def activate(self) -> None:
        """Warn again at the next message that is dropped."""
        self._warned = False

    def deactivate(self) -> None:
        """Nothing waits in a publisher."""

    def destroy(self) -> None:
        """Leave the topic."""
        self._qos_events.close()
        self._leave()
        self._tally.end()
        self._core.node.destroy_publisher(self._publisher)

    def _watchers(self, port: Port) -> Iterator[Target]:
        yield from self._core.chains.watching(port)
        if self._core.mutations is not None:
            yield Remembered(self._core.mutations, f"published by '{self._name}'")

    def _drop(self) -> None:
        self._core.statistics.dropped += 1
        if not self._warned:
            self._warned = True
            reason = self._core.gate.refusal
            self._core.log.warn(f"publisher '{self._name}' drops its messages: {reason}")
