"""Messages that a browser publishes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.dashboard.protocol.messages import RequestError, Values
from composer.model import PortKind
from composer.model.qos import PRESETS, Durability, QosProfile, incompatibilities

if TYPE_CHECKING:
    from composer.dashboard.ros_side import RosGraphSide
    from composer.plan.drift import ObservedEndpoint

_PRESETS = ("command", "sensor_data", "state")


class Outgoing:
    """A message with its publisher, once it is open."""

    def __init__(self, topic: str, type_name: str, values: Any, qos: str | None) -> None:
        self.topic = topic
        self.type_name = type_name
        self._values = values
        self._qos = qos
        self._ros: RosGraphSide
        self._publisher: Any = None
        self._message: Any = None

    def open(self, ros: RosGraphSide) -> None:
        """Create the publisher. Raises RosError, RequestError."""
        from composer.client.messages.values import build_message, class_of
        from composer.client.name_matching import full_name
        from composer.runtime.ros.qos_profiles import rclpy_profile

        self._ros = ros
        message_class = class_of(self.type_name)
        values = ros.forms.from_json(self._values, self.type_name, "message")
        self._message = build_message(values, message_class, "the message")
        topic = self.topic = full_name("topic", self.topic)
        self._publisher = ros.session.node.create_publisher(
            message_class, topic, rclpy_profile(self._profile())
        )

    @property
    def subscriptions(self) -> int:
        """The number of subscriptions that receive the message."""
        return int(self._publisher.get_subscription_count())

    def expected(self) -> int:
        """Return the number of known subscriptions that the publisher will match."""
        profile = self._profile()
        ends = _subscriptions(self._ros, self.topic)
        return sum(end.qos is None or not incompatibilities(profile, end.qos) for end in ends)

    def publish(self) -> None:
        """Publish the message once."""
        self._publisher.publish(self._message)

    def wait_until_acknowledged(self) -> None:
        """Wait a second at most until reliable subscriptions have the message."""
        from composer.client.messages.topics import wait_until_acknowledged

        wait_until_acknowledged(self._publisher)

    def close(self) -> None:
        """Destroy the publisher."""
        if self._publisher is not None:
            self._ros.session.node.destroy_publisher(self._publisher)
            self._publisher = None

    def _profile(self) -> QosProfile:
        return suitable_profile(self._ros, self.topic) if self._qos is None else PRESETS[self._qos]


def suitable_profile(ros: RosGraphSide, topic: str) -> QosProfile:
    """Return a profile for a publisher: latched if a subscription to the topic requests that."""
    is_latched = any(
        end.qos is not None and end.qos.durability is Durability.TRANSIENT_LOCAL
        for end in _subscriptions(ros, topic)
    )
    return PRESETS["state" if is_latched else "command"]


def _subscriptions(ros: RosGraphSide, topic: str) -> list[ObservedEndpoint]:
    ends = ros.observed.known().of_topics.get(topic, [])
    return [end for _, end in ends if end.kind is PortKind.SUBSCRIPTION]


def read_outgoing(values: Values) -> Outgoing:
    """Return the message that a request describes. Raises RequestError."""
    topic, type_name = values.text("topic"), values.text("type")
    message, qos = values.mapping("message"), values.optional_text("qos")
    if qos is not None and qos not in _PRESETS:
        raise RequestError("bad_request", f"'qos' must be one of {', '.join(_PRESETS)}")
    return Outgoing(topic, type_name, message, qos)
