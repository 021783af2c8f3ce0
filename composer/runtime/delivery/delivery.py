"""Where the ports of a system meet within the process."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from rclpy.publisher import Publisher
from rclpy.subscription import Subscription

from composer.model import Port
from composer.runtime.delivery.own_publications import ignore_own_publications, why_not_ignored
from composer.runtime.delivery.queue import Queue
from composer.runtime.delivery.topic import Inlet, Outlet, Topic

Leave = Callable[[], None]


class Delivery:
    """The topics of one system that are delivered in the process.

    Ports join with their DDS endpoint, which they have all the same, and leave before they destroy
    it: own endpoints that have matched are known at any time, so the others are outsiders.
    """

    def __init__(self, shared: Mapping[str, str | None]) -> None:
        """``shared`` tells the topics with ports at both ends, and why not, where DDS has to do.

        rclpy must be initialized.
        """
        self._objections = shared
        if None in shared.values():
            reason = why_not_ignored()
            if reason is not None:
                self._objections = dict.fromkeys(shared, reason)
        self._topics = {
            name: Topic() for name, objection in self._objections.items() if objection is None
        }

    def objection(self, port: Port) -> str | None:
        """Return why DDS has to deliver what others in the process publish or hear, or None."""
        return self._objections.get(port.full_name)

    def add_publisher(
        self, port: Port, publisher: Publisher
    ) -> tuple[Callable[[Any], None], Leave]:
        """Return what sends a message of the port, and what ends that."""
        topic = self._topics.get(port.full_name)
        if topic is None:
            return publisher.publish, _nothing
        outlet = Outlet(publisher, port)
        topic.add_outlet(outlet)
        return outlet.send, lambda: topic.remove_outlet(outlet)

    def add_subscription(self, port: Port, subscription: Subscription, queue: Queue) -> Leave:
        """Put into ``queue`` what is published in the process; return what ends that."""
        topic = self._topics.get(port.full_name)
        if topic is None:
            return _nothing
        ignore_own_publications(subscription)
        inlet = Inlet(subscription.msg_type, port, queue)
        topic.add_inlet(inlet)
        return lambda: topic.remove_inlet(inlet)


def _nothing() -> None:
    """Leave what was never joined."""
