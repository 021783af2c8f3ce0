"""Launch files of systems with arguments."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tests.cli.compose import compose

SYSTEM = """\
system: robot
arguments:
  simulation: {default: false, description: 'Whether a "simulator" replaces the driver.'}
  lidar: {choices: [velodyne, ouster], default: velodyne}
  names: {default: [a, b]}
  map: {type: string}
  namespace: lab
nodes:
  "driver_${name}":
    for_each: {name: "${names}"}
    unless: simulation
    on_activate: {log: "${lidar} ${map} ${namespace}"}
"""


@pytest.fixture
def calls(tmp_path: Path) -> dict[str, list[ast.Call]]:
    """Return the calls in the launch file, by the name of the function."""
    path = tmp_path / "robot.yaml"
    path.write_text(SYSTEM, encoding="utf-8")
    done = compose("export", "launch", str(path), "lidar=ouster", "namespace=field")
    assert done.code == 0, done.err
    found: dict[str, list[ast.Call]] = {}
    for node in ast.walk(ast.parse(done.out)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            found.setdefault(node.func.id, []).append(node)
    return found


def test_arguments_are_launch_arguments(calls: dict[str, list[ast.Call]]) -> None:
    declared = {
        ast.literal_eval(call.args[0]): {
            str(item.arg): ast.literal_eval(item.value) for item in call.keywords
        }
        for call in calls["DeclareLaunchArgument"]
    }
    assert list(declared)[3:] == ["simulation", "lidar", "names", "map"]
    assert declared["simulation"] == {
        "default_value": "false",
        "description": 'Whether a "simulator" replaces the driver.',
    }
    assert declared["lidar"] == {"default_value": "ouster", "choices": ["velodyne", "ouster"]}
    assert declared["names"] == {"default_value": '["a", "b"]'}
    assert declared["map"] == {}  # it needs a value


def test_the_system_gets_them(calls: dict[str, list[ast.Call]]) -> None:
    (system,) = calls["ComposeSystem"]
    (passed,) = (item.value for item in system.keywords if item.arg == "arguments")
    assert ast.unparse(passed) == (
        "[['simulation=', LaunchConfiguration('simulation')],"
        " ['lidar=', LaunchConfiguration('lidar')],"
        " ['names=', LaunchConfiguration('names')],"
        " ['map=', LaunchConfiguration('map')], 'namespace=field']"
    )
