"""Rigid transforms, compared with matrices of numpy."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from composer.model import transforms
from composer.model.transforms import IDENTITY, Quaternion, Transform

np = pytest.importorskip("numpy", reason="comes with ROS")

ANGLE = st.floats(-math.pi, math.pi)
COORDINATE = st.floats(-1000.0, 1000.0)
VECTOR = st.tuples(COORDINATE, COORDINATE, COORDINATE)
RATIO = st.floats(0.0, 1.0)


@st.composite
def quaternions(draw: st.DrawFn) -> Quaternion:
    values = draw(st.tuples(*[st.floats(-1.0, 1.0)] * 4))
    assume(math.hypot(*values) > 0.01)
    return transforms.normalized(Quaternion(*values))


TRANSFORM = st.builds(Transform, VECTOR, quaternions())


def matrix(transform: Transform) -> Any:
    """Return the homogeneous matrix of a transform, by the formula of a textbook."""
    x, y, z, w = transform.rotation
    whole = np.eye(4)
    whole[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    whole[:3, 3] = transform.translation
    return whole


def about(axis: int, angle: float) -> Any:
    """Return the matrix of a rotation about an axis."""
    cosine, sine = math.cos(angle), math.sin(angle)
    a, b = (axis + 1) % 3, (axis + 2) % 3
    whole = np.eye(3)
    whole[a, a] = whole[b, b] = cosine
    whole[a, b], whole[b, a] = -sine, sine
    return whole


@given(ANGLE, ANGLE, ANGLE)
def test_angles_are_about_fixed_axes(roll: float, pitch: float, yaw: float) -> None:
    rotation = transforms.quaternion_of_angles(roll, pitch, yaw)
    expected = about(2, yaw) @ about(1, pitch) @ about(0, roll)
    assert matrix(Transform((0.0, 0.0, 0.0), rotation))[:3, :3] == pytest.approx(expected, abs=1e-9)


def test_a_quarter_turn_is_to_the_left() -> None:
    turn = transforms.quaternion_of_angles(0.0, 0.0, math.pi / 2)
    assert turn == pytest.approx((0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)))
    assert transforms.rotate(turn, (1.0, 0.0, 0.0)) == pytest.approx((0.0, 1.0, 0.0))


@given(TRANSFORM, TRANSFORM, VECTOR)
def test_composition(outer: Transform, inner: Transform, point: tuple[float, float, float]) -> None:
    both = transforms.compose(outer, inner)
    expected = matrix(outer) @ matrix(inner)
    assert matrix(both) == pytest.approx(expected, abs=1e-6)
    moved = (expected @ [*point, 1.0])[:3]
    assert transforms.apply(outer, transforms.apply(inner, point)) == pytest.approx(moved, abs=1e-6)


@given(TRANSFORM)
def test_the_inverse_is_that_of_the_matrix(transform: Transform) -> None:
    inverse = transforms.inverse(transform)
    assert matrix(inverse) == pytest.approx(np.linalg.inv(matrix(transform)), abs=1e-6)
    both = transforms.compose(transform, inverse)
    assert matrix(both) == pytest.approx(matrix(IDENTITY), abs=1e-6)


def angle_between(first: Quaternion, second: Quaternion) -> float:
    """Return the angle of the rotation from one to the other, from their matrices."""
    one, other = (matrix(Transform((0.0, 0.0, 0.0), item))[:3, :3] for item in (first, second))
    difference = one.T @ other
    sine = np.linalg.norm(difference - difference.T) / math.sqrt(8.0)
    return math.atan2(float(sine), (float(np.trace(difference)) - 1.0) / 2.0)


@given(quaternions(), quaternions(), RATIO)
def test_rotations_have_constant_speed(first: Quaternion, second: Quaternion, ratio: float) -> None:
    whole = angle_between(first, second)
    assume(whole < math.pi - 0.01)  # otherwise two arcs are equally short
    between = transforms.slerp(first, second, ratio)
    assert math.hypot(*between) == pytest.approx(1.0)
    assert angle_between(first, between) == pytest.approx(ratio * whole, abs=1e-4)
    assert angle_between(between, second) == pytest.approx((1.0 - ratio) * whole, abs=1e-4)


@given(TRANSFORM, TRANSFORM, RATIO)
def test_translations_are_linear(first: Transform, second: Transform, ratio: float) -> None:
    between = transforms.interpolate(first, second, ratio).translation
    ends = np.array(first.translation), np.array(second.translation)
    assert between == pytest.approx(ends[0] + (ends[1] - ends[0]) * ratio, abs=1e-9)


def test_opposite_quaternions_are_the_same_rotation() -> None:
    turn = transforms.quaternion_of_angles(0.1, 0.2, 0.3)
    opposite = Quaternion(*(-value for value in turn))
    middle = transforms.slerp(turn, opposite, 0.5)
    assert angle_between(turn, middle) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("rotation", "expected"),
    [
        (Quaternion(0.0, 0.0, 0.0, 1.0), True),
        (Quaternion(0.0, 0.0, 0.7071, 0.7071), True),
        (Quaternion(0.0, 0.0, 0.0, 0.0), False),
        (Quaternion(0.0, 0.0, 1.0, 1.0), False),
        (Quaternion(0.0, 0.0, math.nan, 1.0), False),
    ],
)
def test_unit_quaternions(rotation: Quaternion, expected: bool) -> None:
    assert transforms.is_unit(rotation) is expected
