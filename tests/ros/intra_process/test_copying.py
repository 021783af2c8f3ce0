"""Copies of messages for ``isolation: copy``: equal, and nothing is shared."""

from __future__ import annotations

from typing import Any

import pytest
from geometry_msgs.msg import Pose, PoseStamped
from nav_msgs.msg import Path
from sensor_msgs.msg import Image, Imu, JointState, LaserScan
from std_msgs.msg import Header, String

from composer.runtime.intra_process.publisher import copy_of

MESSAGES = [
    String(data="text"),
    Image(header=Header(frame_id="camera"), data=bytes(range(256))),
    Imu(orientation_covariance=[float(number) for number in range(9)]),
    LaserScan(ranges=[1.0, 2.0]),
    JointState(name=["left", "right"], position=[1.0, 2.0]),
    Path(poses=[PoseStamped(), PoseStamped(header=Header(frame_id="map"))]),
    Path(poses=(PoseStamped(),)),
]


def parts(value: Any) -> list[object]:
    """Return all mutable parts of a message."""
    if isinstance(value, str | bytes | int | float):
        return []
    if hasattr(value, "get_fields_and_field_types"):
        inner = [getattr(value, name) for name in value.get_fields_and_field_types()]
    else:
        inner = list(value)
    return [value, *(part for item in inner for part in parts(item))]


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: type(message).__name__)
def test_a_copy_is_equal_and_shares_nothing_mutable(message: Any) -> None:
    copy = copy_of(message)
    assert copy == message
    assert type(copy) is type(message)
    shared = {id(part) for part in parts(message)} & {id(part) for part in parts(copy)}
    assert not shared


def test_changing_the_copy_does_not_change_the_original() -> None:
    path = Path(poses=[PoseStamped(pose=Pose())])
    copy_of(path).poses[0].pose.position.x = 1.0
    assert path.poses[0].pose.position.x == 0.0
