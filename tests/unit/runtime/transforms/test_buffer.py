"""The buffer of transforms: lookups through common ancestors, times, and errors."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from composer.behavior import (
    TransformConnectivityError,
    TransformError,
    TransformExtrapolationError,
    TransformLookupError,
)
from composer.model.transforms import (
    IDENTITY,
    Quaternion,
    Transform,
    compose,
    inverse,
    quaternion_of_angles,
)
from composer.runtime.transforms.buffer import Found, TransformBuffer

S = 1_000_000_000


def at(x: float, yaw: float = 0.0) -> Transform:
    return Transform((x, 0.0, 0.0), quaternion_of_angles(0.0, 0.0, yaw))


@pytest.fixture
def buffer() -> TransformBuffer:
    """map -> odom -> base_link -> laser (static); odom at 1 s and 3 s, base_link at 2 s and 4 s."""
    buffer = TransformBuffer()
    for stamp_s, x in ((1, 0.0), (3, 2.0)):
        buffer.insert("map", "odom", stamp_s * S, at(x), static=False)
    for stamp_s, yaw in ((2, 0.0), (4, math.pi / 2)):
        buffer.insert("odom", "base_link", stamp_s * S, at(1.0, yaw), static=False)
    buffer.insert("base_link", "laser", 0, at(0.5), static=True)
    return buffer


def x_of(found: Found) -> float:
    return found.transform.translation[0]


def test_the_latest_time_is_that_of_all_transforms_on_the_way(buffer: TransformBuffer) -> None:
    assert buffer.lookup("odom", "laser", None).stamp_ns == 4 * S
    whole = buffer.lookup("map", "laser", None)
    assert whole.stamp_ns == 3 * S
    # odom is at 2 m, and base_link has turned by 45 degrees.
    assert whole.transform.translation == pytest.approx(
        (3.0 + 0.5 * math.sqrt(0.5), 0.5 * math.sqrt(0.5), 0.0)
    )
    assert buffer.lookup("laser", "base_link", None) == Found(0, inverse(at(0.5)))
    assert buffer.lookup("odom", "odom", None) == Found(3 * S, IDENTITY)
    assert buffer.lookup("map", "map", None) == Found(0, IDENTITY)


def test_transforms_are_interpolated_on_the_way_to_the_common_ancestor(
    buffer: TransformBuffer,
) -> None:
    assert x_of(buffer.lookup("map", "odom", int(2.5 * S))) == pytest.approx(1.5)
    assert x_of(buffer.lookup("map", "odom", 3 * S)) == 2.0
    assert x_of(buffer.lookup("odom", "map", int(1.5 * S))) == pytest.approx(-0.5)
    rotation = buffer.lookup("odom", "laser", 3 * S).transform.rotation
    assert rotation == pytest.approx(quaternion_of_angles(0.0, 0.0, math.pi / 4))
    buffer.insert("base_link", "wheel", 0, at(-0.5), static=True)
    assert x_of(buffer.lookup("laser", "wheel", 99 * S)) == pytest.approx(-1.0)
    assert x_of(buffer.lookup("odom", "base_link", 4 * S)) == 1.0  # later than what odom has


def message_of(kind: type[TransformError], call: object) -> str:
    with pytest.raises(kind) as caught:
        call()  # type: ignore[operator]
    assert type(caught.value) is kind
    return str(caught.value)


def test_errors_name_the_frames_and_the_times(buffer: TransformBuffer) -> None:
    buffer.insert("world", "dock", 0, at(1.0), static=True)
    for wanted, kind, text in (
        (("map", "lasr", None), TransformLookupError, "'lasr' is not known; did you mean 'laser'?"),
        (("/map", "laser", None), TransformLookupError, "'/map' is not known; a frame ID does not"),
        (
            ("map", "dock", None),
            TransformConnectivityError,
            "frames 'map' and 'dock' are not connected: their trees begin at 'map' and 'world'",
        ),
        (("dock", "laser", 3 * S), TransformConnectivityError, "trees begin at 'world' and 'map'"),
        (
            ("map", "laser", int(3.5 * S)),
            TransformExtrapolationError,
            "no transform from 'laser' to 'map' at 3.500 s: the transform from 'odom' to 'map' is "
            "known from 1.000 s to 3.000 s, and the time is later",
        ),
        (("odom", "laser", 1 * S), TransformExtrapolationError, "and the time is earlier"),
    ):
        found = message_of(kind, lambda wanted=wanted: buffer.lookup(*wanted))
        assert text in found
    empty = TransformBuffer()
    text = message_of(TransformLookupError, lambda: empty.lookup("map", "odom", None))
    assert text == "frame 'map' is not known; no transform was received yet"
    empty.insert("map", "odom", S, at(1.0), static=False)
    text = message_of(TransformExtrapolationError, lambda: empty.lookup("map", "odom", 2 * S))
    assert "is known only at 1.000 s, and the time is later" in text


def test_ten_seconds_are_kept(buffer: TransformBuffer) -> None:
    for stamp_s in range(5, 15):
        buffer.insert("odom", "base_link", stamp_s * S, at(1.0), static=False)
    buffer.lookup("odom", "base_link", 4 * S)
    with pytest.raises(TransformExtrapolationError, match=r"from 4\.000 s to 14\.000 s"):
        buffer.lookup("odom", "base_link", 3 * S)
    ignored = buffer.insert("odom", "base_link", 3 * S, at(1.0), static=False)
    assert ignored == "it is 11.000 s older than the latest one"


def test_transforms_may_arrive_in_any_order() -> None:
    buffer = TransformBuffer()
    for stamp_s in (3, 1, 2, 2):
        stamp_ns = stamp_s * S
        assert buffer.insert("/map", "/odom", stamp_ns, at(float(stamp_s)), static=False) is None
    buffer.insert("map", "odom", 2 * S, at(99.0), static=False)  # the first one counts
    assert x_of(buffer.lookup("map", "odom", 2 * S)) == 2.0
    assert x_of(buffer.lookup("map", "odom", int(1.5 * S))) == pytest.approx(1.5)


def test_a_frame_may_get_another_parent() -> None:
    buffer = TransformBuffer()
    buffer.insert("table", "cup", 1 * S, at(1.0), static=False)
    buffer.insert("gripper", "cup", 2 * S, at(2.0), static=False)
    assert x_of(buffer.lookup("table", "cup", int(1.5 * S))) == 1.0  # not interpolated
    assert x_of(buffer.lookup("gripper", "cup", None)) == 2.0
    with pytest.raises(TransformConnectivityError):
        buffer.lookup("table", "cup", None)


@pytest.mark.parametrize(
    ("parent", "child", "transform", "problem"),
    [
        ("", "odom", at(1.0), "the parent has no name"),
        ("map", "/", at(1.0), "the frame has no name"),
        ("map", "/map", at(1.0), "the frame is its own parent"),
        ("map", "odom", at(math.nan), "a value is not finite"),
        ("map", "odom", Transform((0.0, 0.0, 0.0), Quaternion(0.0, 0.0, 0.0, 0.0)), "unit"),
    ],
)
def test_what_tf2_ignores_is_ignored(
    parent: str, child: str, transform: Transform, problem: str
) -> None:
    buffer = TransformBuffer()
    assert problem in str(buffer.insert(parent, child, S, transform, static=False))
    with pytest.raises(TransformLookupError):
        buffer.lookup("map", "odom", None)


def test_clearing_keeps_static_transforms(buffer: TransformBuffer) -> None:
    buffer.clear()
    assert x_of(buffer.lookup("base_link", "laser", None)) == 0.5
    with pytest.raises(TransformLookupError):
        buffer.lookup("odom", "base_link", None)
    buffer.insert("odom", "base_link", S, at(1.0), static=False)  # earlier than before
    assert x_of(buffer.lookup("odom", "laser", None)) == 1.5


def test_a_cycle_ends_with_an_error() -> None:
    buffer = TransformBuffer()
    buffer.insert("a", "b", 0, at(1.0), static=True)
    buffer.insert("b", "a", 0, at(1.0), static=True)
    buffer.insert("c", "d", 0, at(1.0), static=True)
    for stamp_ns in (None, S):
        with pytest.raises(TransformConnectivityError):
            buffer.lookup("d", "a", stamp_ns)


def test_those_that_wait_are_called_until_they_are_removed(buffer: TransformBuffer) -> None:
    calls: list[int] = []

    def retry() -> None:
        calls.append(1)

    buffer.add_waiting(retry)
    buffer.notify()
    buffer.remove_waiting(retry)
    buffer.remove_waiting(retry)
    buffer.notify()
    assert calls == [1]


@settings(max_examples=60)
@given(st.data())
def test_a_lookup_is_the_path_through_the_tree(data: st.DataObject) -> None:
    """In any static tree: the transform to the root, and back down."""
    count = data.draw(st.integers(2, 12))
    parents = [data.draw(st.integers(0, index - 1)) for index in range(1, count)]
    buffer = TransformBuffer()
    to_root = [IDENTITY]
    for child, parent in enumerate(parents, start=1):
        transform = Transform(
            (float(child), data.draw(st.floats(-5.0, 5.0)), 1.0),
            quaternion_of_angles(data.draw(st.floats(-3.0, 3.0)), 0.3, float(child)),
        )
        buffer.insert(f"f{parent}", f"f{child}", 0, transform, static=True)
        to_root.append(compose(to_root[parent], transform))
    target, source = data.draw(st.integers(0, count - 1)), data.draw(st.integers(0, count - 1))
    found = buffer.lookup(f"f{target}", f"f{source}", None).transform
    expected = compose(inverse(to_root[target]), to_root[source])
    assert found.translation == pytest.approx(expected.translation, abs=1e-9)
    same = sum(a * b for a, b in zip(found.rotation, expected.rotation, strict=True))
    assert abs(same) == pytest.approx(1.0)
