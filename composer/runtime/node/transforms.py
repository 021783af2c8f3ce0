"""The transforms that a node broadcasts, and ``transforms`` of a behavior.

See :class:`composer.behavior.Transforms`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, TypeAlias

from builtin_interfaces.msg import Time

from composer.behavior import CallCancelled, TransformError, TransformLookupError
from composer.model import (
    TF_STATIC_TOPIC,
    TF_TOPIC,
    TF_TYPE,
    DynamicTransform,
    Port,
    StaticTransform,
    Transforms,
)
from composer.model.transforms import IDENTITY
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.reactions import MessageReaction
from composer.runtime.executors.futures import Future
from composer.runtime.executors.tracebacks import interruptible
from composer.runtime.ports import RunningPort
from composer.runtime.ports.topics import PublisherPort
from composer.runtime.ros.messages import interface_class
from composer.runtime.transforms.buffer import Found, TransformBuffer
from composer.runtime.transforms.listener import (
    POSES,
    TransformListeners,
    check_transform,
    moved,
    nanoseconds,
    stamped,
    transform_message,
    transform_of,
)

MakePublisher: TypeAlias = Callable[[NodeContext, Port], PublisherPort]


class Broadcaster:
    """Publishes the transforms of a node on /tf and /tf_static, while the node is active.

    As in tf2, each message on /tf_static has all static transforms of the node.
    """

    def __init__(
        self, context: NodeContext, transforms: Transforms, make_publisher: MakePublisher
    ) -> None:
        """Create the publishers. Raises MessageError if tf2_msgs is not installed."""
        self._context = context
        self._message_type = interface_class(TF_TYPE)
        self._declared = {item.child.value: item for item in transforms.broadcasts}
        self._publishers = {
            port.name.value: make_publisher(context, port) for port in transforms.publishers
        }
        self._static: dict[str, Any] = {}

    @property
    def publishers(self) -> Iterator[PublisherPort]:
        """The publishers on /tf and /tf_static, as far as the node needs them."""
        yield from self._publishers.values()

    def begin(self) -> None:
        """Publish the static transforms of the declaration: the node is being activated."""
        stamp = self._context.stamp()
        for child, declared in self._declared.items():
            if isinstance(declared, StaticTransform) and not declared.from_code:
                values = transform_message(declared.values.value if declared.values else IDENTITY)
                self._static[child] = stamped(declared.parent.value, child, stamp, values)
        if self._static:
            self._publish_static()

    def broadcast(self, child: str, transform: Any, stamp: Any = None) -> None:
        """Broadcast a transform with a declared child frame. Raises ValueError."""
        declared = self._declared.get(child)
        if declared is None:
            known = ", ".join(f"'{name}'" for name in self._declared) or "none"
            raise ValueError(f"frame '{child}' is not declared in 'transforms'; declared: {known}")
        check_transform(transform)
        own = transform_message(transform_of(transform))  # the caller may change the other one
        message = stamped(
            declared.parent.value, child, self._context.stamp() if stamp is None else stamp, own
        )
        if isinstance(declared, DynamicTransform):
            self._publish(TF_TOPIC, [message])
        else:
            self._static[child] = message
            self._publish_static()

    def from_messages(self, port: Port) -> Iterator[PoseBroadcast]:
        """Yield what broadcasts the transforms that come from a subscription."""
        for declared in self._declared.values():
            source = declared.source if isinstance(declared, DynamicTransform) else None
            if source is not None and source.value == port.name.value:
                yield PoseBroadcast(self, declared.child.value, port.interface.value)

    def _publish_static(self) -> None:
        self._publish(TF_STATIC_TOPIC, list(self._static.values()))

    def _publish(self, topic: str, transforms: list[Any]) -> None:
        self._publishers[topic].gated.publish(self._message_type(transforms=transforms))


class PoseBroadcast:
    """Broadcasts the pose of each message that a subscription receives."""

    __slots__ = ("_broadcaster", "_child", "_transform_of")

    def __init__(self, broadcaster: Broadcaster, child: str, interface: str) -> None:
        self._broadcaster = broadcaster
        self._child = child
        self._transform_of = POSES[interface]

    def run(self, message: Any) -> None:
        """Broadcast the pose with the time of the message. Raises ValueError."""
        try:
            transform = self._transform_of(message)
            self._broadcaster.broadcast(self._child, transform, message.header.stamp)
        except ValueError as error:
            raise ValueError(f"frame '{self._child}' is not broadcast: {error}") from None


class Broadcasts:
    """What a message of a subscription triggers: broadcasts, and then the reaction, if any."""

    __slots__ = ("_broadcasts", "_reaction")

    def __init__(
        self, broadcasts: tuple[PoseBroadcast, ...], reaction: MessageReaction | None
    ) -> None:
        self._broadcasts = broadcasts
        self._reaction = reaction

    def run(self, *, message: Any) -> None:
        """Broadcast and react. Raises ValueError, and what the reaction raises."""
        try:
            for broadcast in self._broadcasts:
                broadcast.run(message)
        finally:
            if self._reaction is not None:
                self._reaction.run(message=message)


class NodeTransforms(RunningPort):
    """The frames of a configured node: one of its ports, as far as the lifecycle is concerned.

    It uses the buffer of the process from the start of *activating* until the node leaves *active*.
    """

    def __init__(
        self,
        context: NodeContext,
        transforms: Transforms,
        listeners: TransformListeners,
        make_publisher: MakePublisher = PublisherPort,
    ) -> None:
        """Create the publishers. Raises MessageError if tf2_msgs is not installed."""
        self._context = context
        self._listener = listeners.listener(transforms, context.router)
        self._buffer: TransformBuffer | None = None
        self.broadcaster = Broadcaster(context, transforms, make_publisher)

    def begin(self) -> None:
        """Broadcast what is static, and listen: the node is being activated."""
        self.broadcaster.begin()
        self._listen()

    def activate(self) -> None:
        """Begin; listen again if a transition from *active* was refused."""
        self._listen()
        for publisher in self.broadcaster.publishers:
            publisher.activate()

    def deactivate(self) -> None:
        """Stop listening."""
        if self._listener is not None:
            self._buffer = None
            self._listener.leave(self)
        for publisher in self.broadcaster.publishers:
            publisher.deactivate()

    def destroy(self) -> None:
        """Destroy the publishers."""
        self.deactivate()
        for publisher in self.broadcaster.publishers:
            publisher.destroy()

    def _listen(self) -> None:
        if self._listener is not None and self._buffer is None:
            is_simulated = self._context.clock.is_simulated
            self._buffer = self._listener.join(self, is_simulated=is_simulated)

    # --- the API of behaviors

    @interruptible
    def lookup(self, target: str, source: str, *, stamp: Any = None) -> Any:
        """Return the transform from ``source`` to ``target``, a TransformStamped."""
        return _message(target, source, self._lookup(target, source, _time(stamp)))

    @interruptible
    def can_lookup(self, target: str, source: str, *, stamp: Any = None) -> bool:
        """Return whether ``lookup`` would return a transform now."""
        buffer = self._buffer
        if buffer is None:
            return False
        return not isinstance(buffer.find(target, source, _time(stamp)), TransformError)

    def wait(
        self, target: str, source: str, *, stamp: Any = None, timeout_ms: float = 5000.0
    ) -> Future[Any]:
        """Wait for a transform up to the timeout, and return it."""
        future: Future[Any] = Future()
        buffer, stamp_ns = self._buffer, _time(stamp)
        until_s = self._context.loop.clock.monotonic() + timeout_ms / 1000.0
        if buffer is None:
            future.set_exception(self._refusal())
            return future

        def look_up() -> None:
            found = buffer.find(target, source, stamp_ns)
            if not isinstance(found, TransformError):
                future.set_result(_message(target, source, found))

        def missing() -> BaseException:
            found = buffer.find(target, source, stamp_ns)
            if not isinstance(found, TransformError):  # it has arrived at the last moment
                return TransformError("the transform was not available in time")
            error = buffer.explained(found, target, source)
            return type(error)(f"{error} (after {timeout_ms:g} ms)")

        look_up()  # raises for arguments that are not names, which must not be looked up again
        if not future.done():
            buffer.add_waiting(look_up)
            future.add_done_callback(lambda _: buffer.remove_waiting(look_up))
            look_up()  # it may have arrived since the first time
        if not future.done():
            self._context.gate.pending.add(future, until_s, missing)
        return future

    def transform(self, message: Any, target: str) -> Any:
        """Return a message of geometry_msgs in another frame, at the time of its header."""
        header = message.header
        found = self._lookup(target, header.frame_id, _time(header.stamp))
        return moved(message, target, found.transform)

    def broadcast(self, child: str, transform: Any, *, stamp: Any = None) -> None:
        """Broadcast the transform from a declared frame to its parent."""
        self.broadcaster.broadcast(child, transform, stamp)

    def _lookup(self, target: str, source: str, stamp_ns: int | None) -> Found:
        buffer = self._buffer
        if buffer is None:
            raise self._refusal()
        return buffer.lookup(target, source, stamp_ns)

    def _refusal(self) -> Exception:
        if self._listener is None:
            return TransformLookupError("the node has no 'lookup' in its 'transforms'")
        return CallCancelled(self._context.gate.refusal)


def _message(target: str, source: str, found: Found) -> Any:
    stamp_ns, transform = found
    stamp = Time(sec=stamp_ns // 1_000_000_000, nanosec=stamp_ns % 1_000_000_000)
    return stamped(target, source, stamp, transform_message(transform))


def _time(stamp: Any) -> int | None:
    """Return a time in nanoseconds; None for the latest one, which is zero in tf2."""
    if stamp is None:
        return None
    if not isinstance(stamp, Time):
        kind = type(stamp).__name__
        raise TypeError(f"stamp must be a builtin_interfaces/msg/Time, not {kind}")
    return nanoseconds(stamp) or None
