"""Forms follow the definitions of interfaces."""

from __future__ import annotations

import math
from typing import Any

import pytest

from composer.base.folders import interfaces_folder
from composer.dashboard.forms import Forms
from composer.dashboard.protocol.messages import RequestError
from composer.interfaces import Interfaces


@pytest.fixture(scope="module")
def forms() -> Forms:
    return Forms(Interfaces.load([interfaces_folder()]))


def _by_name(fields: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    return {field["name"]: field for field in fields}


def test_parts_ranges_constants_comments_and_arrays(forms: Forms) -> None:
    status = _by_name(forms.form("sensor_msgs/msg/NavSatStatus")["message"])["status"]
    assert (status["kind"], status["minimum"], status["maximum"]) == ("integer", -128, 127)
    assert {"name": "STATUS_FIX", "value": 0} in status["constants"]
    assert not any(item["name"].startswith("SERVICE") for item in status["constants"])
    form = forms.form("composer_interfaces/srv/PlanTrajectory")
    assert list(form) == ["request", "response"]
    request = _by_name(form["request"])
    assert request["start"]["comment"] == "Start of the path [m]."
    assert [field["name"] for field in request["start"]["fields"]] == ["x", "y", "z"]
    assert _by_name(form["response"])["success"]["kind"] == "boolean"
    assert list(forms.form("composer_interfaces/action/Navigate")) == ["goal", "result", "feedback"]
    fields = _by_name(forms.form("geometry_msgs/msg/PoseWithCovariance")["message"])
    assert (fields["covariance"]["kind"], fields["covariance"]["size"]) == ("array", 36)
    assert fields["covariance"]["element"]["kind"] == "number"
    image = _by_name(forms.form("sensor_msgs/msg/Image")["message"])
    assert image["data"]["kind"] == "bytes"
    assert _by_name(image["header"]["fields"])["stamp"]["kind"] == "time"


def test_paths_of_numbers(forms: Forms) -> None:
    paths = forms.numeric_paths("sensor_msgs/msg/LaserScan")
    assert {"header.stamp.sec", "angle_min", "ranges[0]"} <= set(paths)
    assert not {"header", "header.frame_id", "ranges"} & set(paths)


def test_values_that_json_lacks(forms: Forms) -> None:
    values = {"data": "9007199254740993"}
    assert forms.from_json(values, "std_msgs/msg/Int64", "message") == {"data": 9007199254740993}
    pose = {"position": {"x": ".inf", "y": "-.inf", "z": ".nan"}}
    point = forms.from_json(pose, "geometry_msgs/msg/Pose", "message")["position"]
    assert (point["x"], point["y"]) == (math.inf, -math.inf)
    assert math.isnan(point["z"])
    text = {"data": "5"}
    assert forms.from_json(text, "std_msgs/msg/String", "message") == text


@pytest.mark.parametrize(
    ("name", "hint"),
    [("std_msgs/msg/Strin", "did you mean 'std_msgs/msg/String'?"), ("../../etc/passwd", None)],
)
def test_an_unknown_type(forms: Forms, name: str, hint: str | None) -> None:
    with pytest.raises(RequestError, match="there is no type") as caught:
        forms.form(name)
    assert caught.value.code == "not_installed"
    assert hint is None or caught.value.hint == hint
