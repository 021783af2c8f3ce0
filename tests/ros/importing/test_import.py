"""``compose import`` of nodes that were written without the composer."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.ros.support.commands import (
    PROGRAMS,
    compose,
    errors,
    expect_error,
    hand_written,
    listed,
    output_of,
    repeated,
    repeated_until,
    running,
)
from tests.ros.support.in_process import wait_until

THREE = "hand_written_three.py"


def test_live_nodes_are_described_so_that_nothing_differs(tmp_path: Path) -> None:
    written = tmp_path / "robot.yaml"
    known = ("navigate", "wheels.count", "rate_hz", "status", "plan", "path", "scan")

    def is_imported() -> bool:
        """Write the file; say whether all nodes were discovered and have responded."""
        written.unlink(missing_ok=True)
        done = compose("import", "live", "--system", "robot", "-o", written)
        assert (done.returncode, done.stdout) == (0, ""), done.stderr
        is_complete = all(name in written.read_text() for name in known)
        return is_complete and done.stderr == f"wrote {written}\n"

    same = "robot: runs as declared\n"
    with hand_written(THREE):
        wait_until(is_imported, "a description of all nodes")
        assert output_of("validate", written) == ""
        repeated(lambda done: done.stderr == same, "diff", written)
        expect_error("exists already", "import", "live", "-o", written)
        with running(tmp_path / "log.txt", str(written)) as run:
            run.wait_for("2 of 3 nodes active")
            repeated(lambda done: done.stderr == same, "diff", written)
            # The other way around: what runs now is described by the same file.
            text = written.read_text()
            live = ("import", "live", "--system", "robot")
            repeated_until(lambda found: found == text, *live)
            assert run.stop()[0] == 0
        only = listed(("/base",), "import", "live", "--node", "/base/*")
        assert "/base" in only
        assert "lidar" not in only
        expect_error("no node matches nothing", "import", "live", "--node", "nothing")
    lines = written.read_text().splitlines()
    assert "    lifecycle: {autostart: unconfigured}" in lines
    assert "      wheels.count: {type: integer, default: 4}" in lines
    assert "      scan: {type: std_msgs/msg/String, qos: sensor_data}" in lines
    assert any(line.startswith("    action_servers: {navigate: ") for line in lines)


def test_a_class_is_described_by_its_source(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "nodes" / "lidar.yaml"
    monkeypatch.chdir(PROGRAMS)
    assert compose("import", "class", "hand_written_three:Lidar", "-o", path).returncode == 0
    monkeypatch.chdir(tmp_path)
    (tmp_path / "nodes" / THREE).write_text((PROGRAMS / THREE).read_text())
    assert output_of("validate", path) == ""


LAUNCH = """\
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, GroupAction, LogInfo, Shutdown
from launch.actions import TimerAction
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import ComposableNodeContainer, LoadComposableNodes, Node
from launch_ros.actions import PushRosNamespace, SetParameter
from launch_ros.descriptions import ComposableNode


def generate_launch_description():
    return LaunchDescription([
        DeclareLaunchArgument("sim", default_value="false"),
        GroupAction([
            PushRosNamespace("a"),
            SetParameter("use_sim_time", True),
            Node(package="demo", executable="talker", name="talker",
                 parameters=[{"rate": 5.0}, "PARAMETERS"], remappings=[("chatter", "/chat")]),
        ]),
        Node(package="demo", executable="sim", name="sim",
             condition=IfCondition(LaunchConfiguration("sim"))),
        Node(package="demo", executable="driver", parameters=["PARAMETERS"], respawn=True,
             respawn_delay=1.5, respawn_max_retries=4, cwd="/tmp", sigterm_timeout="9",
             prefix="nice", on_exit=[LogInfo(msg="ended")]),
        TimerAction(period=2.5, actions=[
            Node(package="demo", executable="last", name="last", respawn=True,
                 respawn_max_retries=0, on_exit=Shutdown()),
        ]),
        ExecuteProcess(cmd=["true"]),
        ComposableNodeContainer(
            package="rclcpp_components", executable="component_container", name="box",
            namespace="b", composable_node_descriptions=[
                ComposableNode(package="demo", plugin="demo::Camera", name="camera",
                               parameters=[{"rate": 5.0}], remappings=[("image", "/image")],
                               extra_arguments=[{"use_intra_process_comms": True}]),
                ComposableNode(package="demo", plugin="demo::Lidar", name="lidar",
                               condition=IfCondition(LaunchConfiguration("sim"))),
            ]),
        LoadComposableNodes(target_container="other", composable_node_descriptions=[
            ComposableNode(package="demo", plugin="demo::Imu")]),
    ])
"""


@pytest.mark.skipif(find_spec("launch_ros") is None, reason="launch_ros is not installed")
def test_the_nodes_of_a_launch_file_are_described(tmp_path: Path) -> None:
    parameters = tmp_path / "parameters.yaml"
    parameters.write_text(
        "/a/talker: {ros__parameters: {rate: 7.5}}\n/**: {ros__parameters: {x: 1}}\n"
        "wheel: {left: {ros__parameters: {radius: 0.1}}}\n"
    )
    file = tmp_path / "robot.launch.py"
    file.write_text(LAUNCH.replace("PARAMETERS", str(parameters)))
    done = compose("import", "launch", file)
    assert done.returncode == 0, done.stderr
    assert done.stderr.splitlines()[1:] == [  # after the warning that its code runs
        "left out:",
        "  timer: what it starts after 2.5 s starts at once",
        "  process: true",
        "  prefix: nice (of /driver)",
        "  on_exit: LogInfo (of /driver)",
        "  parameters of /wheel/left in some programs only: use_sim_time",
        "  parameters of /wheel/left: with --output, a file has them",
    ]
    assert (
        done.stdout.partition("nodes:\n")[2]
        == """\
  talker:
    namespace: /a
    executable: {package: demo, name: talker}
    parameters:
      use_sim_time: {type: bool, default: true}
      rate: {type: double, default: 7.5}
      x: {type: integer, default: 1}
    remappings: {chatter: /chat}
  # The launch file does not name its nodes; list them under 'nodes'.
  # Its parameter files name: /a/talker, /wheel/left.
  driver:
    executable:
      package: demo
      name: driver
      nodes: []
      working_directory: /tmp
      sigterm_timeout_ms: 9000
    lifecycle:
      on_failure: restart
      restart: {backoff_ms: 1500, backoff_max_ms: 1500, max_attempts: 4}
    parameters: {x: {type: integer, default: 1}}
  # Started after 2.5 s by the launch file.
  last: {executable: {package: demo, name: last}, lifecycle: {on_failure: shutdown}}
  box: {namespace: /b, executable: {package: rclcpp_components, name: component_container}}
  camera:
    component:
      package: demo
      plugin: "demo::Camera"
      extra_arguments: {use_intra_process_comms: true}
    container: box
    parameters: {rate: {type: double, default: 5.0}}
    remappings: {image: /image}
  # The launch file does not name it: demo::Imu does.
  Imu: {component: {package: demo, plugin: "demo::Imu"}, container: other}
  sim: {if: sim, executable: {package: demo, name: sim}}
  lidar: {if: sim, component: {package: demo, plugin: "demo::Lidar"}, container: box}
  # The launch file loads components into it, and does not start it.
  other: {external: true}
"""
    )
    written = tmp_path / "robot.yaml"
    assert compose("import", "launch", file, "-o", written).returncode == 0
    assert (
        "  ros__parameters: {x: 1, radius: 0.1}\n"
        in (tmp_path / "robot_parameters.yaml").read_text()
    )
    assert compose("validate", written).returncode == 0
    assert "arguments: {sim: true}\n" in output_of("import", "launch", file, "sim:=true")


@pytest.mark.skipif(find_spec("launch_ros") is None, reason="launch_ros is not installed")
@pytest.mark.parametrize(
    ("start", "result", "message"),
    [
        (
            "from ament_index_python.packages import get_package_share_directory",
            "get_package_share_directory('no_such_package')",
            ":3: PackageNotFoundError: package 'no_such_package' not found, ",
        ),
        (
            "import launch, launch_ros.actions",
            "launch.LaunchDescription([launch_ros.actions.Node(package='demo', executable="
            "launch.substitutions.FindExecutable(name='no_program'))])",
            ": SubstitutionFailure: executable '['no_program']' not found on the PATH",
        ),
    ],
)
def test_the_first_cause_of_a_failure_is_named(
    start: str, result: str, message: str, tmp_path: Path
) -> None:
    file = tmp_path / "robot.launch.py"
    file.write_text(f"{start}\ndef generate_launch_description():\n    return {result}\n")
    expect_error(message, "import", "launch", file)


@pytest.mark.skipif(find_spec("launch_ros") is not None, reason="launch_ros is installed")
def test_a_missing_launch_is_reported(tmp_path: Path) -> None:
    file = tmp_path / "robot.launch.py"
    file.write_text(LAUNCH)
    (text,) = errors(("import", "launch", str(file)))
    assert "needs launch, which is not installed in this Python" in text
    assert sys.modules.get("launch") is None
