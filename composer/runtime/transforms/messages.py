"""Transforms in messages of tf2 and in poses.

Message packages are imported when they are used: few systems have transforms.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from composer.model.geometry import Quaternion, Transform, Vector, apply, is_unit, multiply, rotate
from composer.runtime.ros.messages import interface_class

_NANOSECONDS = 1_000_000_000


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
