"""Launch files that run a system, and their arguments."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tests.cli.compose import compose
from tests.unit.support.checking import write_files

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


def calls_in_launch_file(folder: Path) -> dict[str, list[ast.Call]]:
    """Return the calls in the launch file of the system, by the name of the function."""
    path = folder / "robot.yaml"
    path.write_text(SYSTEM, encoding="utf-8")
    done = compose("export", "launch", str(path), "lidar=ouster", "namespace=field")
    assert done.code == 0, done.err
    found: dict[str, list[ast.Call]] = {}
    for node in ast.walk(ast.parse(done.out)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            found.setdefault(node.func.id, []).append(node)
    return found


def test_arguments_are_launch_arguments_and_the_system_gets_them(tmp_path: Path) -> None:
    calls = calls_in_launch_file(tmp_path)
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
    (system,) = calls["ComposeSystem"]
    (passed,) = (item.value for item in system.keywords if item.arg == "arguments")
    names = ("simulation", "lidar", "names", "map")
    values = [f"['{name}=', LaunchConfiguration('{name}')]" for name in names]
    assert ast.unparse(passed) == f"[{', '.join(values)}, 'namespace=field']"


def test_the_path_of_the_system_is_relative(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    system = "system: robot\nnodes: {a: {on_activate: {log: hello}}}\n"
    write_files(tmp_path, {"systems/robot.yaml": system})
    command = ("export", "launch", "systems/robot.yaml", "-o", "launch/robot.launch.py")
    done = compose(*command)
    assert (done.code, done.out) == (0, ""), done.err
    path = tmp_path / "launch" / "robot.launch.py"
    text = path.read_text()
    ast.parse(text)
    assert "SYSTEM = (Path(__file__).parent / '../systems/robot.yaml').resolve()" in text
    assert compose(*command).err == "launch/robot.launch.py is up to date\n"
    path.write_text("my own")
    done = compose(*command)
    assert done.code == 1
    assert "exists already" in done.err
    assert compose(*command, "--force").code == 0
    assert path.read_text() == text
    # On stdout the path is absolute.
    done = compose("export", "launch", "robot")
    assert done.code == 0, done.err
    assert f"SYSTEM = Path({str(tmp_path / 'systems' / 'robot.yaml')!r})\n" in done.out
