"""The frames of tf2 that a node broadcasts and looks up, and rigid transforms between frames.

A transform is a translation and a rotation, as in geometry_msgs/msg/Transform. Functions are pure
and work on tuples of floats: for three or four numbers, arrays are slower.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import field
from typing import NamedTuple, TypeAlias

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, Span
from composer.model.ports import Port, PortKind, Qos
from composer.model.qos import Durability, QosProfile

Vector: TypeAlias = tuple[float, float, float]

#: tf2 accepts quaternions whose squared length differs from 1 by less than this.
UNIT_TOLERANCE = 10e-3
#: Below this angle between two rotations (as 1 - cos), interpolation is linear.
_SMALL_ANGLE = 1e-9
TF_TYPE = "tf2_msgs/msg/TFMessage"
TF_TOPIC = "/tf"
TF_STATIC_TOPIC = "/tf_static"
#: The messages with a pose and a time, from which a transform can be broadcast.
POSE_TYPES = (
    "nav_msgs/msg/Odometry",
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "geometry_msgs/msg/TransformStamped",
)
#: The QoS of tf2_ros. A static broadcaster sends all of its transforms in each message.
_DYNAMIC = QosProfile(depth=100)
_STATIC = QosProfile(depth=1, durability=Durability.TRANSIENT_LOCAL)
_STATIC_LISTENER = QosProfile(depth=100, durability=Durability.TRANSIENT_LOCAL)


class Quaternion(NamedTuple):
    """A rotation; a unit quaternion with the scalar part ``w``, in the order of ROS."""

    x: float
    y: float
    z: float
    w: float


class Transform(NamedTuple):
    """Maps coordinates in a child frame to its parent frame: rotate, then translate."""

    translation: Vector
    rotation: Quaternion


IDENTITY = Transform((0.0, 0.0, 0.0), Quaternion(0.0, 0.0, 0.0, 1.0))


def quaternion_of_angles(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return the rotation by three angles in radians about the fixed axes x, y and z (REP 103)."""
    sr, cr = math.sin(roll / 2), math.cos(roll / 2)
    sp, cp = math.sin(pitch / 2), math.cos(pitch / 2)
    sy, cy = math.sin(yaw / 2), math.cos(yaw / 2)
    return Quaternion(
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def is_unit(rotation: Quaternion) -> bool:
    """Return whether tf2 accepts a quaternion as a rotation; false for NaN."""
    return abs(_dot(rotation, rotation) - 1.0) < UNIT_TOLERANCE


def multiply(first: Quaternion, second: Quaternion) -> Quaternion:
    """Return the rotation by ``second``, followed by ``first``."""
    ax, ay, az, aw = first
    bx, by, bz, bw = second
    return Quaternion(
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def conjugate(rotation: Quaternion) -> Quaternion:
    """Return the inverse of a rotation."""
    x, y, z, w = rotation
    return Quaternion(-x, -y, -z, w)


def rotate(rotation: Quaternion, vector: Vector) -> Vector:
    """Return a vector after a rotation."""
    x, y, z, w = rotation
    vx, vy, vz = vector
    # v + 2 q x (q x v + w v)
    tx, ty, tz = 2 * (y * vz - z * vy), 2 * (z * vx - x * vz), 2 * (x * vy - y * vx)
    return (
        vx + w * tx + y * tz - z * ty,
        vy + w * ty + z * tx - x * tz,
        vz + w * tz + x * ty - y * tx,
    )


def apply(transform: Transform, point: Vector) -> Vector:
    """Return the coordinates of a point of the child frame in the parent frame."""
    x, y, z = rotate(transform.rotation, point)
    tx, ty, tz = transform.translation
    return x + tx, y + ty, z + tz


def compose(outer: Transform, inner: Transform) -> Transform:
    """Return ``outer`` after ``inner``: the transform of a grandchild to its grandparent."""
    return Transform(apply(outer, inner.translation), multiply(outer.rotation, inner.rotation))


def inverse(transform: Transform) -> Transform:
    """Return the transform in the other direction."""
    rotation = conjugate(transform.rotation)
    x, y, z = rotate(rotation, transform.translation)
    return Transform((-x, -y, -z), rotation)


def interpolate(first: Transform, second: Transform, ratio: float) -> Transform:
    """Return the transform between two: at ``ratio`` 0 the first, at 1 the second.

    Translations are interpolated linearly, rotations on the shortest arc at a constant speed.
    """
    ax, ay, az = first.translation
    bx, by, bz = second.translation
    translation = (ax + (bx - ax) * ratio, ay + (by - ay) * ratio, az + (bz - az) * ratio)
    return Transform(translation, slerp(first.rotation, second.rotation, ratio))


def slerp(first: Quaternion, second: Quaternion, ratio: float) -> Quaternion:
    """Return the rotation between two, on the shortest arc."""
    cosine = _dot(first, second)
    sign = 1.0
    if cosine < 0.0:  # q and -q are the same rotation
        cosine, sign = -cosine, -1.0
    if cosine > 1.0 - _SMALL_ANGLE:
        weight, other = 1.0 - ratio, ratio
    else:
        angle = math.acos(cosine)
        weight = math.sin((1.0 - ratio) * angle) / math.sin(angle)
        other = math.sin(ratio * angle) / math.sin(angle)
    return normalized(
        Quaternion(*(weight * a + sign * other * b for a, b in zip(first, second, strict=True)))
    )


def normalized(rotation: Quaternion) -> Quaternion:
    """Return a quaternion of length 1. Raises ZeroDivisionError for zero."""
    length = math.hypot(*rotation)
    x, y, z, w = rotation
    return Quaternion(x / length, y / length, z / length, w / length)


def _dot(first: Quaternion, second: Quaternion) -> float:
    ax, ay, az, aw = first
    bx, by, bz, bw = second
    return ax * bx + ay * by + az * bz + aw * bw


@dataclass(frozen=True, slots=True)
class StaticTransform:
    """A transform that does not change; without ``values``, child and parent coincide.

    With ``from_code``, the code of the node broadcasts it. What nodes that were not written for the
    composer broadcast is up to them. ``angles_rad`` are the angles of the rotation that are written
    in radians.
    """

    child: Located[str]
    parent: Located[str]
    values: Located[Transform] | None
    from_code: bool = False
    angles_rad: tuple[Located[float], ...] = ()


@dataclass(frozen=True, slots=True)
class DynamicTransform:
    """A transform that changes: with each message of the subscription ``source``, or by code."""

    child: Located[str]
    parent: Located[str]
    source: Located[str] | None


@dataclass(frozen=True, slots=True)
class Transforms:
    """The frames of a node. ``lookup`` are those that it looks up; None if it looks up none.

    ``ports`` are the publishers and subscriptions on /tf and /tf_static that follow from them. They
    have no place among the ports of the node: only the composer uses them.
    """

    span: Span = field(compare=False)
    static: tuple[StaticTransform, ...] = ()
    dynamic: tuple[DynamicTransform, ...] = ()
    lookup: Located[tuple[Located[str], ...]] | None = None
    ports: tuple[Port, ...] = ()

    @property
    def broadcasts(self) -> tuple[StaticTransform | DynamicTransform, ...]:
        """All transforms that the node broadcasts."""
        return self.static + self.dynamic

    @property
    def publishers(self) -> tuple[Port, ...]:
        """The publishers among the ports."""
        return tuple(port for port in self.ports if port.kind is PortKind.PUBLISHER)

    def port(self, kind: PortKind, name: str) -> Port | None:
        """Return the port of a kind that is declared as ``name``: /tf or /tf_static."""
        found = (port for port in self.ports if port.kind is kind and port.name.value == name)
        return next(found, None)


def transform_ports(
    span: Span, *, has_static: bool, has_dynamic: bool, looks_up: bool
) -> Iterator[Port]:
    """Yield the ports on /tf and /tf_static that a node with transforms needs."""
    if has_static:
        yield _port(PortKind.PUBLISHER, TF_STATIC_TOPIC, _STATIC, span)
    if has_dynamic:
        yield _port(PortKind.PUBLISHER, TF_TOPIC, _DYNAMIC, span)
    if looks_up:
        yield _port(PortKind.SUBSCRIPTION, TF_STATIC_TOPIC, _STATIC_LISTENER, span)
        yield _port(PortKind.SUBSCRIPTION, TF_TOPIC, _DYNAMIC, span)


def _port(kind: PortKind, topic: str, profile: QosProfile, span: Span) -> Port:
    name = Located(topic, span)
    return Port(
        kind=kind,
        name=name,
        interface=Located(TF_TYPE, span),
        ros_name=name,
        full_name=topic,
        qos=Qos(profile, span),
        span=span,
        external=True,  # tools and other nodes may use the topic as well
    )
