"""Publishers as nodes use them: gated by the lifecycle, with in-process targets."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Sequence
from copy import deepcopy
from typing import Any

from numpy import ndarray
from rclpy.publisher import Publisher
from rclpy.serialization import deserialize_message

from composer.base.fast_dataclass import dataclass
from composer.runtime.clock import Clock
from composer.runtime.host_options import Target
from composer.runtime.intra_process.dds_flags import MATCH_FLAG, MATCHING
from composer.runtime.intra_process.lifecycle_gate import LifecycleGate

_IMMUTABLE = frozenset({int, float, bool, str, bytes})
_COPIES: dict[type, Callable[[Any], Any]] = {array: lambda value: value[:], ndarray: ndarray.copy}


class FanOut:
    """Puts each message to several targets."""

    __slots__ = ("_targets",)

    def __init__(self, targets: Sequence[Target]) -> None:
        self._targets = targets

    def put(self, message: Any) -> None:
        """Put the message to each target."""
        for target in self._targets:
            target.put(message)


def combined(targets: Sequence[Target]) -> Target | None:
    """Return one target for all of ``targets``; None for none, a single one itself."""
    if not targets:
        return None
    return targets[0] if len(targets) == 1 else FanOut(targets)


@dataclass(frozen=True, slots=True)
class PublisherContext:
    """What a publisher needs of its node.

    ``on_refused`` is called for each message that is published while the gate is closed.
    ``observers`` receive each message before any other target. Without ``listens_to_matches``,
    matched subscriptions are counted for each message.
    """

    gate: LifecycleGate
    clock: Clock
    on_refused: Callable[[], None]
    observers: tuple[Target, ...] = ()
    listens_to_matches: bool = True


class GatedPublisher:
    """Publishes by DDS while the gate is open; a ``LocalPublisher`` also in the process.

    Users know it as :class:`composer.behavior.Publisher`. One object per publisher holds everything
    that a message needs, for cache locality.
    """

    __slots__ = (
        "_gate",
        "_generation",
        "_has_external",
        "_publish",
        "_refuse",
        "_target",
        "count",
        "message_type",
    )

    def __init__(self, publisher: Publisher, context: PublisherContext) -> None:
        self._gate = context.gate
        self._refuse = context.on_refused
        # Not rclpy's own ``publish``, which checks the type again. The interpreter's lock is held
        # throughout, so no other thread destroys the publisher meanwhile.
        self._publish: Callable[[Any], None] = publisher.handle.publish
        #: Number of messages published.
        self.count = 0
        #: The message class of the topic.
        self.message_type: Any = publisher.msg_type
        self._target = combined(context.observers)
        self._has_external = True  # without local subscriptions, DDS knows best
        self._generation: object = None  # of the matches, when last counted

    def publish(self, message: Any) -> None:
        """Publish ``message``, from any thread. Raises TypeError if it has another type.

        It is dropped and counted while the node is not active.
        """
        if not self._gate.outgoing:
            self._refuse()
            return
        if type(message) is not self.message_type:
            message = self._converted(message)
        if self._target is not None:
            self._target.put(message)
        if not MATCH_FLAG[0]:
            MATCHING.begin_generation()
        if self._generation is not MATCHING.generation:
            self._check_external()
        if self._has_external:
            self._publish(message)
        self.count += 1

    def _check_external(self) -> None:
        """Check for subscriptions in other processes: first, and after each change of matches."""
        self._generation = MATCHING.generation

    def _converted(self, message: Any) -> Any:
        """Return what rclpy would publish. Raises TypeError where rclpy would."""
        if isinstance(message, self.message_type):
            return message
        if isinstance(message, bytes):
            return deserialize_message(message, self.message_type)
        raise TypeError(f"Expected {self.message_type}, got {type(message)}")


def copy_of(message: Any) -> Any:
    """Return a copy that shares nothing mutable with ``message``."""
    kind = type(message)
    copy: Any = object.__new__(kind)
    for slot in kind.__slots__:
        setattr(copy, slot, _copy_of_value(getattr(message, slot)))
    return copy


def _copy_of_value(value: Any) -> Any:
    kind = type(value)
    if kind in _IMMUTABLE:
        return value
    if kind in _COPIES:
        return _COPIES[kind](value)
    if kind is list:
        of_immutable = value and type(value[0]) in _IMMUTABLE
        return value[:] if of_immutable else [_copy_of_value(item) for item in value]
    if hasattr(kind, "get_fields_and_field_types"):
        return copy_of(value)
    return deepcopy(value)  # assigned by user code; no type of ROS
