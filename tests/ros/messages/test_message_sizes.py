"""Definitions of real packages: which messages may be large, their fields, and the wheels."""

from __future__ import annotations

import re
from importlib.metadata import PackageNotFoundError, requires
from pathlib import Path

import pytest
from composer_interfaces.action import Navigate
from composer_interfaces.srv import PlanTrajectory

from composer.interfaces.sources import Bundle
from composer.loading import load
from composer.model.interface_packages import NOT_IN_WHEELS
from composer.runtime.ros.message_sizes import may_be_large, sends_large_messages
from composer.runtime.ros.messages import interface_class

REQUIREMENT = re.compile(r"(?P<name>[\w.-]+)\s*(\[(?P<extra>\w+)\])?")
CONDITION = re.compile(r"extra == .(?P<extra>\w+)")
TEXTS = {"success": "boolean", "message": "string"}
POINT = "geometry_msgs/Point"


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


@pytest.mark.parametrize(
    ("message", "fields"),
    [
        (PlanTrajectory.Request, {"start": POINT, "goal": POINT, "max_velocity": "double"}),
        (PlanTrajectory.Response, {"path": "nav_msgs/Path", **TEXTS}),
        (Navigate.Goal, {"target": POINT, "max_velocity": "double"}),
        (Navigate.Result, {**TEXTS, "distance_traveled": "double"}),
        (Navigate.Feedback, {"progress_percent": "double", "current_position": POINT}),
    ],
)
def test_our_interfaces_have_the_fields_that_systems_rely_on(
    message: type, fields: dict[str, str]
) -> None:
    assert message.get_fields_and_field_types() == fields  # type: ignore[attr-defined]


def installed(package: str, extra: str | None) -> set[tuple[str, str | None]]:
    """Return the packages that pip installs with a package and one of its extras."""
    found: set[tuple[str, str | None]] = set()
    left = [(package, extra)]
    while left:
        if (item := left.pop()) in found:
            continue
        found.add(item)
        try:
            texts = requires(item[0]) or ()
        except PackageNotFoundError:  # for another platform
            continue
        for text in texts:
            condition, required = CONDITION.search(text), REQUIREMENT.match(text)
            if required and (condition is None or condition["extra"] == item[1]):
                left.append((required["name"].replace("_", "-"), required["extra"]))
    return found


def test_packages_that_ros_on_pypi_lacks_are_known() -> None:
    names = {name.replace("-", "_") for name, _ in installed("ros2-composer", "ros")}
    found = {re.sub("^(ros_)?(jazzy_)?", "", name) for name in names}
    assert "sensor_msgs" in found
    assert Bundle().packages() - found == NOT_IN_WHEELS
