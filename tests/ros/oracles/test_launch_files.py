"""Launch files under launch and as imported systems: what each process gets, and when all end."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

pytestmark = [
    pytest.mark.skipif(find_spec("launch_ros") is None, reason="needs launch_ros"),
    pytest.mark.timeout(180),
]
LIMIT_S = 60.0
#: The node of the package ``probe``: it records what it got, then waits, fails or ends.
PROBE = f"""#!{sys.executable}
import json, os, sys, time
import rclpy
from rclpy.node import Node
from rclpy.utilities import remove_ros_args

rclpy.init()
node = Node("probe", automatically_declare_parameters_from_overrides=True)
values = {{name: item.value for name, item in node.get_parameters_by_prefix("").items()}}
record = {{
    "name": node.get_fully_qualified_name(),
    "parameters": {{name: getattr(v, "tolist", lambda: v)() for name, v in values.items()}},
    "names": [node.resolve_topic_name(name) for name in ("chatter", "~/state", "/absolute")],
    "service": node.resolve_service_name("add"),
    "environment": {{name: os.environ.get(name) for name in ("PROBE_ALL", "PROBE_ONE")}},
    "arguments": remove_ros_args(sys.argv)[1:],
    "folder": os.getcwd(),
}}
out = os.environ["PROBE_OUT"]
with open(out, "a") as file:
    file.write(json.dumps(record) + "\\n")

def starts(name):
    with open(out) as file:
        return sum(json.loads(line)["name"].endswith(name) for line in file)

if "fail_until" in values and starts(record["name"]) < values["fail_until"]:
    sys.exit(3)
waits_for = dict(zip(values.get("nodes", []), values.get("starts", [])))
while not waits_for or any(starts(name) < number for name, number in waits_for.items()):
    rclpy.spin_once(node, timeout_sec=0.1)
"""
LAUNCH = """
import sys
import launch
from launch.launch_description_sources import AnyLaunchDescriptionSource

service = launch.LaunchService(argv=sys.argv[2:])
arguments = [tuple(item.split(":=")) for item in sys.argv[2:]]
source = AnyLaunchDescriptionSource(sys.argv[1])
service.include_launch_description(
    launch.LaunchDescription(
        [launch.actions.IncludeLaunchDescription(source, launch_arguments=arguments)]
    )
)
sys.exit(service.run())
"""
#: Each ends itself: its last node waits for what the others record.
FILES = {
    "names.launch.py": """
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, GroupAction, SetEnvironmentVariable, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node, PushRosNamespace, SetParameter, SetRemap

def generate_launch_description():
    rate = LaunchConfiguration("rate")
    return LaunchDescription([
        DeclareLaunchArgument("rate", default_value="2.5"),
        SetEnvironmentVariable("PROBE_ALL", "all"),
        Node(package="probe", executable="probe"),
        Node(package="probe", executable="probe", name="renamed", namespace="robot1",
             parameters=[{"rate": rate, "count": 3, "on": True, "names": ["a", "b"], "text": "3",
                          "gain.1": 16}],
             remappings=[("chatter", "/news"), ("~/state", "status")],
             additional_env={"PROBE_ONE": "one"}, arguments=["--flag", "value"]),
        GroupAction([
            PushRosNamespace("fleet"),
            SetParameter("shared", 7),
            SetRemap("add", "sum"),
            Node(package="probe", executable="probe", name="inner", namespace="left"),
            Node(package="probe", executable="probe", name="absolute", namespace="/top"),
        ]),
        Node(package="probe", executable="probe", name="last", on_exit=Shutdown(),
             parameters=[{"nodes": ["/probe", "renamed", "inner", "absolute"],
                          "starts": [1, 1, 1, 1]}]),
    ])
""",
    "files.launch.xml": """
<launch>
  <arg name="robot" default="r2"/>
  <group>
    <push-ros-namespace namespace="$(var robot)"/>
    <node pkg="probe" exec="probe" name="planner">
      <param from="$(dirname)/robot.yaml"/>
      <param name="own" value="1.5"/>
      <param name="nested.deep" value="[1, 2, 3]"/>
      <remap from="chatter" to="talk"/>
      <env name="PROBE_ONE" value="$(var robot)"/>
    </node>
  </group>
  <node pkg="probe" exec="probe" name="last" on_exit="shutdown">
    <param name="nodes" value="[planner]"/>
    <param name="starts" value="[1]"/>
  </node>
</launch>
""",
    "respawn.launch.py": """
from launch import LaunchDescription
from launch.actions import Shutdown
from launch_ros.actions import Node

def generate_launch_description():
    return LaunchDescription([
        Node(package="probe", executable="probe", name="flaky", respawn=True, respawn_delay=0.2,
             parameters=[{"fail_until": 3}]),
        Node(package="probe", executable="probe", name="once", parameters=[{"fail_until": 9}]),
        Node(package="probe", executable="probe", name="last", on_exit=Shutdown(),
             parameters=[{"nodes": ["flaky", "once"], "starts": [3, 1]}]),
    ])
""",
}
PARAMETERS = """
/**:
  ros__parameters: {shared: [true, false], limits: {low: -1, high: 1.0e3}}
/r3/planner:
  ros__parameters: {special: yes}
other:
  ros__parameters: {foreign: 1}
"""


def package(folder: Path) -> dict[str, str]:
    """Make a prefix with the package ``probe``; return the environment in which it is found."""
    prefix = folder / "prefix"
    index = prefix / "share" / "ament_index" / "resource_index" / "packages" / "probe"
    program = prefix / "lib" / "probe" / "probe"
    for path, text in ((index, ""), (program, PROBE)):
        path.parent.mkdir(parents=True)
        path.write_text(text)
    (prefix / "share" / "probe").mkdir()
    program.chmod(0o755)
    prefixes = [str(prefix), os.environ.get("AMENT_PREFIX_PATH", sys.prefix)]
    return {"AMENT_PREFIX_PATH": os.pathsep.join(prefixes), "ROS_LOG_DIR": str(folder / "log")}


def recorded(folder: Path) -> list[dict[str, Any]]:
    path = folder / "out.jsonl"
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    path.unlink()
    return sorted(lines, key=lambda item: str(item["name"]))


@pytest.mark.parametrize(
    ("file", "arguments", "exit_code"),
    [
        ("names.launch.py", (), 0),
        ("names.launch.py", ("rate:=4.0",), 0),
        ("files.launch.xml", (), 0),
        ("files.launch.xml", ("robot:=r3",), 0),
        ("respawn.launch.py", (), 1),  # a process has failed: launch does not mind
    ],
)
def test_imported_launch_files_behave_as_under_launch(
    file: str, arguments: tuple[str, ...], exit_code: int, tmp_path: Path
) -> None:
    environment = package(tmp_path) | {"PROBE_OUT": str(tmp_path / "out.jsonl")}
    (tmp_path / file).write_text(FILES[file])
    (tmp_path / "robot.yaml").write_text(PARAMETERS)

    def run(*command: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, *command],
            cwd=tmp_path,
            env=os.environ | environment,
            timeout=LIMIT_S,
            capture_output=True,
            text=True,
            check=False,
        )

    launched = run("-c", LAUNCH, file, *arguments)
    assert launched.returncode == 0, launched.stderr
    expected = recorded(tmp_path)
    done = run("-m", "composer", "import", "launch", file, *arguments, "-o", "system.yaml")
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "system.yaml").read_text()
    ready = rf"package: probe\1ready_timeout_ms: {1000 * LIMIT_S:g}\1"  # on a busy machine
    (tmp_path / "system.yaml").write_text(re.sub(r"package: probe(, |\n +)", ready, text))
    done = run("-m", "composer", "run", "system.yaml")
    assert done.returncode == exit_code, done.stderr
    # It may end before the system has noticed that it is up.
    ended = "/last ended: (activate failed: )?its process exited with status 0"
    assert re.search(ended, done.stderr), done.stderr
    assert recorded(tmp_path) == expected, text
