from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from tests.cli.compose import compose, run_python

#: Python without rclpy, as on a computer that has no ROS.
WITHOUT_ROS = """
import importlib.util as util, sys
class NoRos:
    def find_spec(self, name, *_):
        if name == 'rclpy':
            raise ModuleNotFoundError(name)
found = util.find_spec
util.find_spec = lambda name, *rest: None if name == 'rclpy' else found(name, *rest)
sys.meta_path.insert(0, NoRos())
from composer.cli import main
sys.exit(main(sys.argv[1:]))
"""


def test_without_rclpy_everything_else_is_checked() -> None:
    done = run_python("-c", WITHOUT_ROS, "doctor", "--json")
    assert done.returncode == 1, done.stderr
    found = {(item["area"], item["level"]): item for item in json.loads(done.stdout)}
    assert "rclpy is not installed" in found["versions", "error"]["message"]
    assert "ros2-composer[ros]" in found["versions", "error"]["remedy"]
    assert found["graph", "note"]["message"] == "not checked: rclpy is not installed"
    assert {area for area, _ in found} >= {"environment", "versions", "graph"}
    assert "Traceback" not in done.stderr


def test_interface_packages_are_those_of_the_project_and_of_the_system(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not those of the examples, which a project of its own does not need."""
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCLHOST")  # the ROS graph is not checked
    Path("composer.yaml").touch()
    assert "interfaces   " not in compose("doctor").out
    lines = compose("doctor", "pipeline").out.splitlines()
    (found,) = [line for line in lines if "  interfaces   " in line]
    assert "composer_interfaces" in found  # it is built if ROS is installed


def test_an_invalid_environment_is_reported_before_ros_starts(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    index = tmp_path / "share" / "ament_index" / "resource_index" / "rmw_typesupport"
    index.mkdir(parents=True)
    (index / "rmw_fastrtps_cpp").touch()
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_foo")
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCLHOST")
    done = compose("doctor")
    assert done.code == 1
    assert "error    environment  RMW_IMPLEMENTATION is 'rmw_foo', which is not" in done.out
    lines = done.out.splitlines()
    reported = "ROS_AUTOMATIC_DISCOVERY_RANGE is 'LOCLHOST', which is not a discovery range"
    (number,) = [number for number, line in enumerate(lines) if line.endswith(reported)]
    assert lines[number].startswith("error    environment  ")
    assert lines[number + 1].strip().startswith("-> did you mean LOCALHOST?")
    assert "not checked: the environment does not let ROS start" in done.out


def test_problems_are_counted_and_have_remedies(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "x")
    monkeypatch.setenv("ROS_DISTRO", "humble")
    assert compose("doctor").err.endswith(", 1 warning\n")
    found = json.loads(compose("doctor", "--json").out)
    assert all(item["remedy"] for item in found if item["level"] != "ok")
