"""The transforms on /tf and /tf_static, once for all nodes of a process; transforms in messages.

A listener of tf2_ros has two subscriptions and a buffer per node. Here the manager node subscribes
while a node of the process that looks up frames is active.

Message packages are imported when they are used: few systems have transforms.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping
from dataclasses import field
from typing import Any

from rclpy.node import Node
from rclpy.subscription import Subscription
from rclpy.time import Time

from composer.base.fast_dataclass import dataclass
from composer.model import TF_STATIC_TOPIC, TF_TOPIC, Port, PortKind, Transforms
from composer.model.transforms import (
    Quaternion,
    Transform,
    Vector,
    apply,
    is_unit,
    multiply,
    rotate,
)
from composer.runtime.clock import Clock
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.sources import Taken
from composer.runtime.intra_process.router import LocalRouter
from composer.runtime.metrics.repeat_limit import RepeatLimit
from composer.runtime.node_time import SimTimeSource
from composer.runtime.ros.conversions import rclpy_profile
from composer.runtime.ros.messages import interface_class
from composer.runtime.transforms.buffer import TransformBuffer

_WARNING_PERIOD_S = 10.0
_NANOSECONDS = 1_000_000_000


class TransformListeners:
    """The listeners of a process, one for each pair of topics; most systems have one pair."""

    def __init__(
        self, node: Node, loop: Loop, sim_time: SimTimeSource, warn: Callable[[str], None]
    ) -> None:
        """Subscribe with ``node``, on ``loop``; call ``warn`` for transforms that are not valid."""
        self._node = node
        self._loop = loop
        self._sim_time = sim_time
        self._warn = warn
        self._creating = threading.Lock()
        self._listeners: dict[tuple[str, str], TransformListener] = {}

    def listener(self, transforms: Transforms, router: LocalRouter) -> TransformListener | None:
        """Return the listener for the frames of a node; None if it looks up none. Thread-safe."""
        static = transforms.port(PortKind.SUBSCRIPTION, TF_STATIC_TOPIC)
        dynamic = transforms.port(PortKind.SUBSCRIPTION, TF_TOPIC)
        if static is None or dynamic is None:
            return None
        key = (static.full_name, dynamic.full_name)
        with self._creating:
            if key not in self._listeners:
                topics = _Topics(self._node, self._loop, router, static, dynamic)
                self._listeners[key] = TransformListener(
                    topics, self._loop.clock, self._sim_time, self._warn
                )
            return self._listeners[key]


class TransformListener:
    """Fills a buffer while it has users; the last one that leaves empties it."""

    def __init__(
        self,
        topics: _Topics,
        clock: Clock,
        sim_time: SimTimeSource,
        warn: Callable[[str], None],
    ) -> None:
        self._topics = topics
        self._sim_time = sim_time
        self._warn = warn
        self._repeats = RepeatLimit(clock, _WARNING_PERIOD_S)
        self._changing = threading.Lock()
        self._users: dict[object, bool] = {}  # with simulated time, or not
        self._now_ns = 0  # of /clock
        self.buffer = TransformBuffer()

    def join(self, user: object, *, is_simulated: bool) -> TransformBuffer:
        """Return the buffer, which is filled from now on. From any thread."""
        with self._changing:
            if not self._users:
                self.buffer = buffer = TransformBuffer()
                self._topics.open(_Receiver(self, buffer, static=True), _Receiver(self, buffer))
            self._users[user] = is_simulated
            self._follow_clock()
            return self.buffer

    def leave(self, user: object) -> None:
        """Stop using the buffer. From any thread."""
        with self._changing:
            if self._users.pop(user, None) is None:
                return
            self._follow_clock()
            if not self._users:
                self._topics.close()

    def ignore(self, what: str, problem: str) -> None:
        """Log that a transform is ignored, from time to time."""
        self._repeats.warn(self._warn, what, f"ignored the transform {what}: {problem}")

    def _follow_clock(self) -> None:
        if any(self._users.values()):
            self._sim_time.join(self._on_time)
        else:
            self._sim_time.leave(self._on_time)

    def _on_time(self, now: Time) -> None:
        """Forget what is known when the simulated time goes back, as tf2 does."""
        if now.nanoseconds < self._now_ns:
            self.buffer.clear()
        self._now_ns = now.nanoseconds


class _Receiver:
    """Puts the transforms of one topic into a buffer, on the thread of the publisher or of DDS."""

    def __init__(
        self, listener: TransformListener, buffer: TransformBuffer, *, static: bool = False
    ) -> None:
        self._listener = listener
        self._buffer = buffer
        self._static = static
        self._is_open = True

    def put(self, message: Any) -> None:
        """Add the transforms of a message."""
        if not self._is_open:
            return
        for item in message.transforms:
            header = item.header
            problem = self._buffer.insert(
                header.frame_id,
                item.child_frame_id,
                nanoseconds(header.stamp),
                transform_of(item.transform),
                static=self._static,
            )
            if problem is not None:
                self._listener.ignore(
                    f"from '{item.child_frame_id}' to '{header.frame_id}'", problem
                )
        self._buffer.notify()

    def receive(self, taken: Taken) -> None:
        """Add the transforms of a message that came by DDS."""
        self.put(taken[0])

    def close(self) -> None:
        """Receive nothing more."""
        self._is_open = False


@dataclass(slots=True)
class _Topics:
    """The subscriptions of a listener, which exist while it is open."""

    node: Node
    loop: Loop
    router: LocalRouter
    static: Port
    dynamic: Port
    _wanted: tuple[_Receiver, _Receiver] | None = None
    _open: tuple[_Receiver, _Receiver] | None = None
    _ends: list[Callable[[], None]] = field(default_factory=list)

    def open(self, static: _Receiver, dynamic: _Receiver) -> None:
        """Receive from now on. From any thread."""
        self._wanted = (static, dynamic)
        self.loop.call_soon(self._update)

    def close(self) -> None:
        """Receive nothing more, at once. From any thread."""
        for receiver in self._wanted or ():
            receiver.close()
        self._wanted = None
        self.loop.call_soon(self._update)

    def _update(self) -> None:
        wanted = self._wanted
        if self._open is wanted:
            return
        while self._ends:
            self._ends.pop()()
        self._open = wanted
        if wanted is not None:
            for port, receiver in zip((self.static, self.dynamic), wanted, strict=True):
                self._ends.append(self._subscribe(port, receiver))

    def _subscribe(self, port: Port, receiver: _Receiver) -> Callable[[], None]:
        subscription: Subscription = self.node.create_subscription(
            interface_class(port.interface.value),
            port.full_name,
            receiver.receive,
            rclpy_profile(port.qos.profile),
        )
        remove = self.router.add_subscription(port, subscription, receiver)
        self.loop.add_subscription(subscription, receiver.receive)

        def end() -> None:
            remove()
            self.loop.remove(subscription)
            self.node.destroy_subscription(subscription)

        return end


def nanoseconds(stamp: Any) -> int:
    """Return the time of a builtin_interfaces/msg/Time."""
    return int(stamp.sec) * _NANOSECONDS + int(stamp.nanosec)


def transform_of(message: Any) -> Transform:
    """Return the transform in a geometry_msgs/msg/Transform."""
    translation, rotation = message.translation, message.rotation
    return Transform(
        (translation.x, translation.y, translation.z),
        Quaternion(rotation.x, rotation.y, rotation.z, rotation.w),
    )


def stamped(parent: str, child: str, stamp: Any, transform: Any) -> Any:
    """Return the TransformStamped of a geometry_msgs/msg/Transform."""
    message = _geometry("TransformStamped")()
    message.header.frame_id = parent
    message.header.stamp = stamp
    message.child_frame_id = child
    message.transform = transform
    return message


def transform_message(transform: Transform) -> Any:
    """Return a transform as a geometry_msgs/msg/Transform."""
    message = _geometry("Transform")()
    translation, rotation = message.translation, message.rotation
    translation.x, translation.y, translation.z = transform.translation
    rotation.x, rotation.y, rotation.z, rotation.w = transform.rotation
    return message


def check_transform(message: Any) -> None:
    """Raise ValueError for a geometry_msgs/msg/Transform that tf2 would ignore."""
    expected = _geometry("Transform")
    if type(message) is not expected:
        raise ValueError(f"expected a geometry_msgs/msg/Transform, got {type(message).__name__}")
    translation, rotation = transform_of(message)
    if not all(map(math.isfinite, translation)):
        raise ValueError("the translation is not finite")
    if not is_unit(rotation):
        raise ValueError("the rotation is not a unit quaternion")


def moved(message: Any, target: str, transform: Transform) -> Any:
    """Return a stamped message of geometry_msgs in the frame ``target``. Raises TypeError."""
    kind = type(message)
    move = _MOVES.get(kind.__name__)
    if move is None or kind.__module__.partition(".")[0] != "geometry_msgs":
        raise TypeError(f"cannot transform {kind.__name__}; transform one of {', '.join(_MOVES)}")
    result = kind()
    result.header.stamp = message.header.stamp
    result.header.frame_id = target
    move(message, result, transform)
    return result


def _move_point(message: Any, result: Any, transform: Transform) -> None:
    _set_vector(result.point, apply(transform, _vector(message.point)))


def _move_vector(message: Any, result: Any, transform: Transform) -> None:
    _set_vector(result.vector, rotate(transform.rotation, _vector(message.vector)))


def _move_quaternion(message: Any, result: Any, transform: Transform) -> None:
    _turn(message.quaternion, result.quaternion, transform)


def _move_pose(message: Any, result: Any, transform: Transform) -> None:
    _set_vector(result.pose.position, apply(transform, _vector(message.pose.position)))
    _turn(message.pose.orientation, result.pose.orientation, transform)


_MOVES: Mapping[str, Callable[[Any, Any, Transform], None]] = {
    "PointStamped": _move_point,
    "Vector3Stamped": _move_vector,
    "QuaternionStamped": _move_quaternion,
    "PoseStamped": _move_pose,
}


def _turn(rotation: Any, result: Any, transform: Transform) -> None:
    own = Quaternion(rotation.x, rotation.y, rotation.z, rotation.w)
    result.x, result.y, result.z, result.w = multiply(transform.rotation, own)


def _vector(message: Any) -> Vector:
    return message.x, message.y, message.z


def _set_vector(message: Any, vector: Vector) -> None:
    message.x, message.y, message.z = vector


def _of_pose(pose: Any) -> Any:
    position, orientation = pose.position, pose.orientation
    rotation = Quaternion(orientation.x, orientation.y, orientation.z, orientation.w)
    return transform_message(Transform((position.x, position.y, position.z), rotation))


#: How to get the transform from each of :data:`composer.model.POSE_TYPES`.
POSES: Mapping[str, Callable[[Any], Any]] = {
    "nav_msgs/msg/Odometry": lambda message: _of_pose(message.pose.pose),
    "geometry_msgs/msg/PoseStamped": lambda message: _of_pose(message.pose),
    "geometry_msgs/msg/PoseWithCovarianceStamped": lambda message: _of_pose(message.pose.pose),
    "geometry_msgs/msg/TransformStamped": lambda message: message.transform,
}


def _geometry(name: str) -> Any:
    return interface_class(f"geometry_msgs/msg/{name}")
