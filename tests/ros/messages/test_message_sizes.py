"""Which messages may be large, by the definitions of real packages."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.loading import load
from composer.runtime.ros.message_sizes import may_be_large, sends_large_messages
from composer.runtime.ros.messages import interface_class


@pytest.mark.parametrize(
    ("name", "large"),
    [
        ("sensor_msgs/msg/Image", True),
        ("sensor_msgs/msg/CompressedImage", True),
        ("sensor_msgs/msg/PointCloud2", True),
        ("nav_msgs/msg/OccupancyGrid", True),
        ("stereo_msgs/msg/DisparityImage", True),  # an image within it
        ("sensor_msgs/msg/Imu", False),  # arrays of 9 numbers
        ("std_msgs/msg/String", False),
        ("geometry_msgs/msg/PolygonStamped", False),  # an array of points
        ("rcl_interfaces/msg/ParameterEvent", True),
    ],
)
def test_messages(name: str, large: bool) -> None:
    assert may_be_large(interface_class(name)) is large


@pytest.mark.parametrize(
    ("port", "large"),
    [
        ("publishers: {a: {type: sensor_msgs/msg/Image}}", True),
        ("subscriptions: {a: {type: sensor_msgs/msg/Image}}", False),
        ("services: {a: {type: nav_msgs/srv/GetMap}}", True),  # the map is in the response
        ("clients: {a: {type: nav_msgs/srv/GetMap}}", False),
        ("clients: {a: {type: nav_msgs/srv/SetMap}}", True),
        ("action_servers: {a: {type: tf2_msgs/action/LookupTransform}}", False),
        ("publishers: {a: {type: unknown_msgs/msg/Image}}", False),
        ("executable: {command: [cam]}, publishers: {a: {type: sensor_msgs/msg/Image}}", False),
    ],
)
def test_what_a_system_sends(port: str, large: bool, tmp_path: Path) -> None:
    path = tmp_path / "one.yaml"
    path.write_text(f"system: one\nnodes: {{n: {{{port}}}}}\n", encoding="utf-8")
    system = load(path).system
    assert system is not None
    assert sends_large_messages(system) is large
