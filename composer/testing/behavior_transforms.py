"""The frames of a behavior in a test. They need the message packages of ROS."""

from __future__ import annotations

from typing import Any, cast

from composer.model import TF_STATIC_TOPIC, Transforms
from composer.model.transforms import Quaternion, Transform, Vector
from composer.runtime.node.transforms import NodeTransforms
from composer.runtime.transforms.buffer import TransformBuffer
from composer.runtime.transforms.listener import TransformListeners, nanoseconds, transform_of
from composer.testing.behavior_context import TestContext
from composer.testing.behavior_ports import PublisherPort
from composer.testing.failures import TestFailure


class TestTransforms(NodeTransforms):
    """``transforms`` of a behavior, with the transforms of the test and of the behavior itself."""

    __test__ = False

    def __init__(self, context: TestContext, transforms: Transforms, message_type: Any) -> None:
        self.frames = TransformBuffer()
        listeners = cast(TransformListeners, _Listeners(self.frames))
        super().__init__(
            cast(Any, context),
            transforms,
            listeners,
            lambda _, port: cast(Any, PublisherPort(context, port.name.value, message_type)),
        )

    def insert(
        self, parent: str, child: str, values: tuple[Vector, Quaternion], stamp_ns: int | None
    ) -> None:
        """Add a transform, valid at any time without ``stamp_ns``. Raises TestFailure."""
        is_static = stamp_ns is None
        transform = Transform(*values)
        problem = self.frames.insert(parent, child, stamp_ns or 0, transform, static=is_static)
        if problem is not None:
            raise TestFailure(f"transform from '{child}' to '{parent}': {problem}")
        self.frames.notify()

    def on_broadcast(self, topic: str, message: Any) -> None:
        """Add what the behavior broadcasts."""
        for item in message.transforms:
            stamp_ns = None if topic == TF_STATIC_TOPIC else nanoseconds(item.header.stamp)
            values = transform_of(item.transform)
            self.insert(item.header.frame_id, item.child_frame_id, values, stamp_ns)


class _Listeners:
    """Stands for the subscriptions on /tf and /tf_static."""

    def __init__(self, frames: TransformBuffer) -> None:
        self._frames = frames

    def listener(self, transforms: Transforms, _router: object) -> _Listeners | None:
        """Return what a node listens with, if it looks up frames."""
        return None if transforms.lookup is None else self

    def join(self, _user: object, *, is_simulated: bool) -> TransformBuffer:  # noqa: ARG002
        """Return the frames."""
        return self._frames

    def leave(self, _user: object) -> None:
        """Do nothing: there is no subscription."""
