"""The transforms that a node broadcasts."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from composer.model import (
    TF_STATIC_TOPIC,
    TF_TOPIC,
    TF_TYPE,
    DynamicTransform,
    Port,
    StaticTransform,
    Transforms,
)
from composer.model.geometry import IDENTITY
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.reactions import MessageReaction
from composer.runtime.ports.publisher import PublisherPort
from composer.runtime.ros.messages import interface_class
from composer.runtime.transforms.messages import (
    POSES,
    check_transform,
    stamped,
    transform_message,
    transform_of,
)


class Broadcaster:
    """Publishes the transforms of a node on /tf and /tf_static, while the node is active.

    As in tf2, each message on /tf_static has all static transforms of the node.
    """

    def __init__(self, context: NodeContext, transforms: Transforms) -> None:
        """Create the publishers. Raises MessageError if tf2_msgs is not installed."""
        self._context = context
        self._message_type = interface_class(TF_TYPE)
        self._declared = {item.child.value: item for item in transforms.broadcasts}
        self._publishers = {
            port.name.value: PublisherPort(context, port) for port in transforms.publishers
        }
        self._static: dict[str, Any] = {}

    @property
    def publishers(self) -> Iterator[PublisherPort]:
        """The publishers on /tf and /tf_static, as far as the node needs them."""
        yield from self._publishers.values()

    def begin(self) -> None:
        """Publish the static transforms of the declaration: the node is being activated."""
        stamp = self._now()
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
            declared.parent.value, child, self._now() if stamp is None else stamp, own
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

    def _now(self) -> Any:
        return self._context.node.get_clock().now().to_msg()


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
