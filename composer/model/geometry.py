"""Rigid transforms: a translation and a rotation, as in geometry_msgs/msg/Transform.

Functions are pure and work on tuples of floats: for three or four numbers, arrays are slower.
"""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias

Vector: TypeAlias = tuple[float, float, float]

#: tf2 accepts quaternions whose squared length differs from 1 by less than this.
UNIT_TOLERANCE = 10e-3
#: Below this angle between two rotations (as 1 - cos), interpolation is linear.
_SMALL_ANGLE = 1e-9


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
