"""What a node publishes with."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from rclpy.publisher import Publisher
from rclpy.serialization import deserialize_message

from composer.runtime.intra_process.lifecycle_gate import Gate
from composer.runtime.intra_process.match_flag import MARK, MATCHES


class Target(Protocol):
    """Where messages are put."""

    def put(self, message: Any) -> None:
        """Take in the message, from any thread."""


class FanOut:
    """Puts messages to each of some targets."""

    __slots__ = ("_targets",)

    def __init__(self, targets: Sequence[Target]) -> None:
        self._targets = targets

    def put(self, message: Any) -> None:
        """Put it to each of them."""
        for target in self._targets:
            target.put(message)


def as_one(targets: Sequence[Target]) -> Target | None:
    """Return what puts messages to all of ``targets``: where there is one, as most often, that."""
    if not targets:
        return None
    return targets[0] if len(targets) == 1 else FanOut(targets)


@dataclass(frozen=True, slots=True)
class Origin:
    """The node of a publisher, as far as messages have to do with it.

    ``refuse`` is told that a message comes while the gate is shut; ``watchers`` get each message
    before everybody else.
    """

    gate: Gate
    refuse: Callable[[], None]
    watchers: tuple[Target, ...] = ()


class Sender:
    """Hands messages to its targets, and to DDS where somebody outside listens.

    This is what users know as a publisher (:class:`composer.behavior.Publisher`). Everything that a
    message needs is in this one object: in a large system what it costs is to fetch objects from
    far away in memory. As it is, messages go by DDS alone.
    """

    __slots__ = (
        "_gate",
        "_has_outsiders",
        "_period",
        "_publish",
        "_refuse",
        "_target",
        "count",
        "message_type",
    )

    def __init__(self, publisher: Publisher, origin: Origin) -> None:
        self._gate = origin.gate
        self._refuse = origin.refuse
        # Not rclpy's own ``publish``, which looks at the type once more. The interpreter's lock is
        # held all along, so nobody destroys the publisher meanwhile.
        self._publish: Callable[[Any], None] = publisher.handle.publish
        #: How many messages were sent.
        self.count = 0
        #: The message class of the topic.
        self.message_type: Any = publisher.msg_type
        self._target = as_one(origin.watchers)
        self._has_outsiders = True  # whether there are is for DDS to know
        self._period: object = None  # in which it was last looked who is there

    def publish(self, message: Any) -> None:
        """Send ``message``, from any thread. Raises TypeError when it is not of the topic's type.

        It is dropped and counted while the node is not active.
        """
        if not self._gate.outgoing:
            self._refuse()
            return
        if type(message) is not self.message_type:
            message = self._converted(message)
        if self._target is not None:
            self._target.put(message)
        if not MARK[0]:
            MATCHES.begin_period()
        if self._period is not MATCHES.period:
            self._look_outside()
        if self._has_outsiders:
            self._publish(message)
        self.count += 1

    def _look_outside(self) -> None:
        """See whether somebody outside listens: once, and when something has matched or left."""
        self._period = MATCHES.period

    def _converted(self, message: Any) -> Any:
        """Return what rclpy would publish. Raises TypeError where it would."""
        if isinstance(message, self.message_type):
            return message
        if isinstance(message, bytes):
            return deserialize_message(message, self.message_type)
        raise TypeError(f"Expected {self.message_type}, got {type(message)}")
