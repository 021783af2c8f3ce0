"""A long-lived session for several threads, and messages taken at a pace of the caller's own."""

from __future__ import annotations

import logging
import threading
import time
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.serialization import deserialize_message

from composer.base.fast_dataclass import dataclass
from composer.client.messages.values import class_of
from composer.client.session import Deadline, Session
from composer.model.qos import QosProfile
from composer.runtime.ros.conversions import rclpy_profile
from composer.runtime.ros.graph import GraphChanges

InvalidHandle = rclpy_implementation.InvalidHandle
_WAIT_S = 0.02
#: The executor is woken up when there is something to do.
_SPIN_S = 60.0
_JOIN_S = 2.0
#: A permanent fault must not take a whole processor.
_AFTER_FAILURE_S = 0.1


class SharedSession(Session):
    """A session with threads of its own: any number of threads may wait at the same time.

    An executor of rclpy serves clients and subscriptions. It takes most of a millisecond for each
    event, so frequent messages do without: the caller takes the messages of :meth:`sample`, and
    what arrives in between costs no Python at all. ``changes`` counts the changes of the graph.
    """

    def __init__(self) -> None:
        """Join the ROS graph. Raises RosError."""
        super().__init__()
        self.changes = GraphChanges(self.node)
        self._handled = threading.Condition()
        self._is_open = True
        self._samples = Node(f"{self.node.get_name()}_samples", **self._node_options())
        self._thread = threading.Thread(target=self._spin, name="ros session", daemon=True)
        self._thread.start()

    def __exit__(self, *exception: object) -> None:
        self._is_open = False
        self._executor.shutdown(_JOIN_S)  # ends the wait, which a mere wake-up does not
        self._thread.join(_JOIN_S)
        self._samples.destroy_node()
        super().__exit__(*exception)

    def spin_once(self, deadline: Deadline) -> None:
        """Wait briefly for an event, not beyond the deadline."""
        with self._handled:
            self._handled.wait(min(_WAIT_S, deadline.left_s))

    def sample(
        self, topic: str, type_name: str, qos: QosProfile, *, raw: bool = False
    ) -> SampledTopic:
        """Subscribe to a topic. Raises InvalidValueError if the type is not installed."""
        return SampledTopic(self._samples, topic, type_name, qos, raw=raw)

    def _spin(self) -> None:
        while self._is_open:
            try:
                self._executor.spin_once(timeout_sec=_SPIN_S)
            except InvalidHandle:  # another thread has destroyed an entity
                pass
            except Exception:  # a callback has failed
                if not self._is_open:
                    return
                logging.getLogger(__name__).exception("a callback of the session failed")
                time.sleep(_AFTER_FAILURE_S)
            with self._handled:
                self._handled.notify_all()


@dataclass(frozen=True, slots=True)
class Sample:
    """A message, or its serialized bytes, with its source timestamp in seconds since 1970.

    ``number`` is the sequence number that its publisher gave it, 0 if unknown; ``received_ns`` when
    it arrived, in nanoseconds since 1970.
    """

    content: Any
    at_s: float
    number: int
    received_ns: int


class SampledTopic:
    """A subscription whose messages are taken on request; QoS limits what waits meanwhile."""

    def __init__(
        self, node: Node, topic: str, type_name: str, qos: QosProfile, *, raw: bool
    ) -> None:
        self._node = node
        self._subscription = node.create_subscription(
            class_of(type_name), topic, _ignore, rclpy_profile(qos), raw=raw
        )
        self._raw = raw

    def take(self, limit: int) -> list[Sample]:
        """Return the oldest messages that have arrived, at most ``limit``."""
        samples: list[Sample] = []
        handle, message_type = self._subscription.handle, self._subscription.msg_type
        with handle:
            while len(samples) < limit:
                found = handle.take_message(message_type, self._raw)
                if found is None:
                    break
                content, info = found
                samples.append(
                    Sample(
                        content,
                        (info["source_timestamp"] or time.time_ns()) * 1e-9,
                        int(info["publication_sequence_number"] or 0),
                        int(info["received_timestamp"] or time.time_ns()),
                    )
                )
        return samples

    def message(self, sample: Sample) -> Any:
        """Return the message of a sample of serialized bytes."""
        return deserialize_message(sample.content, self._subscription.msg_type)

    def close(self) -> None:
        """Destroy the subscription."""
        self._node.destroy_subscription(self._subscription)


def _ignore(_: Any) -> None:
    """Serve as a callback that is never called."""
