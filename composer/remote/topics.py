"""Topics of any ROS graph: who is at their ends, what comes over them, and putting things on."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass
from typing import Any, Self

from composer.qos import Durability, QosProfile, Reliability
from composer.remote.graph_names import Names, other_types
from composer.remote.name_matching import full_name
from composer.remote.session import Deadline, NoAnswer, RosError, Session
from composer.remote.values import class_of
from composer.runtime.ros.endpoints import TopicInfo, topic_info
from composer.runtime.ros.qos_profiles import rclpy_profile

_LISTEN_DEPTH = 1000


@dataclass(frozen=True, slots=True)
class Received:
    """A message, or its serialized bytes, and when it came (seconds, time.monotonic)."""

    content: Any
    at_s: float


class Topics:
    """Looks at topics, and takes part in them, until the deadline."""

    def __init__(self, session: Session, deadline: Deadline) -> None:
        self._session = session
        self._deadline = deadline
        self._names = Names(session, deadline)

    def info(self, name: str) -> TopicInfo:
        """Return who publishes and subscribes to a topic. Raises NotThere."""
        types = self._names.types("topic", name)
        wanted = full_name("topic", name)
        return self._session.wait_until_still(
            lambda: topic_info(self._session.node, wanted, types), self._deadline
        )

    def type_of(self, name: str) -> str:
        """Return the one type of a topic. Raises NotThere, and RosError where there are more."""
        types = self._names.types("topic", name)
        if len(types) > 1:
            raise RosError(
                f"topic '{name}' has more than one type", "say which: " + ", ".join(types)
            )
        return types[0]

    def matching(self, name: str) -> QosProfile:
        """Return the strongest profile that all publishers of a topic satisfy."""
        found = topic_info(self._session.node, name, ()).publishers
        return strongest_for_all([publisher.qos for publisher in found], depth=_LISTEN_DEPTH)


class Listener:
    """A subscription that collects what is published. Use it in a ``with`` block.

    With ``raw`` the content of what is received is the serialized bytes.
    """

    def __init__(
        self, session: Session, topic: str, type_name: str, qos: QosProfile, *, raw: bool = False
    ) -> None:
        self.topic = topic
        self._session = session
        self._type_name = type_name
        self._received: deque[Received] = deque()
        self._subscription = session.node.create_subscription(
            class_of(type_name),
            topic,
            lambda content: self._received.append(Received(content, time.monotonic())),
            rclpy_profile(qos),
            raw=raw,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._session.node.destroy_subscription(self._subscription)

    def silence(self, timeout_s: float) -> NoAnswer:
        """Return the error that says that nothing came for so long, and why if that is known."""
        hint = other_types(self._session, "topic", self.topic, self._type_name)
        return NoAnswer(f"nothing came over '{self.topic}' for {timeout_s:g} s", hint)

    def take(self, deadline: Deadline) -> list[Received]:
        """Return what has come; waits until something has, or the deadline."""
        self._session.wait_for(lambda: self._received or None, deadline)
        taken = list(self._received)
        self._received.clear()
        return taken


def strongest_for_all(offers: list[QosProfile], depth: int) -> QosProfile:
    """Return the profile of a subscription that matches every offer and asks for no less.

    See the offer/request rule in :mod:`composer.qos`.
    """
    reliable = all(offer.reliability is Reliability.RELIABLE for offer in offers)
    kept = all(offer.durability is Durability.TRANSIENT_LOCAL for offer in offers)
    return QosProfile(
        depth=depth,
        reliability=Reliability.RELIABLE if offers and reliable else Reliability.BEST_EFFORT,
        durability=Durability.TRANSIENT_LOCAL if offers and kept else Durability.VOLATILE,
    )
