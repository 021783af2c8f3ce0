"""The command line of an executable, as ``ros2 run --ros-args`` would have it."""

from __future__ import annotations

import sys
from pathlib import Path
from textwrap import dedent

import pytest

from composer.language.document import parse_bytes
from composer.model import LogLevel, System
from composer.model.resolve import resolve
from composer.project import Project
from composer.project.node_types import NodeTypes
from composer.runtime.children.command_line import (
    NotRunnable,
    make_command,
    parameter_file,
    remappings,
)

SYSTEM = """
system: arm
namespace: robot
nodes:
  driver:
    namespace: left
    executable:
      command: [./driver.sh, --fast]
      arguments: [--level, 3, true]
      environment: {DEVICE: /dev/ttyUSB0, RATE: 10}
    remappings: {~/status: /status, unlisted: /listed}
    publishers:
      joints: {type: std_msgs/msg/String}
      status: {type: std_msgs/msg/String, topic: ~/status}
      same: {type: std_msgs/msg/String}
    action_servers:
      move: {type: composer_interfaces/action/Navigate}
    parameters:
      rate: {type: double, default: 10}
      name: {type: string, default: "007: no"}
      gains: {type: double_array, default: [1, 2.5]}
      nothing: {type: integer_array, default: []}
      unset: {type: integer}
      enabled: {type: bool, default: true}
connections:
  - {topic: /joints, from: driver.joints}
  - {action: /move_arm, server: driver.move}
"""


def system_of(text: str, folder: Path) -> System:
    tree, source, _ = parse_bytes(dedent(text).encode(), "system.yaml")
    assert tree is not None
    types = NodeTypes.of(Project.at(folder))
    system, _ = resolve(tree, source, types, folders={source.path: folder})
    assert system is not None
    return system


def test_the_command_of_a_node(tmp_path: Path) -> None:
    program = tmp_path / "driver.sh"
    program.write_text("#!/bin/sh\n", encoding="utf-8")
    program.chmod(0o755)
    node = system_of(SYSTEM, tmp_path).nodes[0]
    assert node.executable is not None
    command = make_command(node, node.executable, LogLevel.WARN, {"PATH": "/usr/bin"})
    words = list(command.words)
    begin = words.index("--ros-args")
    assert words[:begin] == [str(program), "--fast", "--level", "3", "true"]
    assert words[begin + 1 : begin + 5] == ["-r", "__node:=driver", "-r", "__ns:=/robot/left"]
    assert words[-2:] == ["--log-level", "warn"]
    assert command.folder == tmp_path
    assert command.environment["DEVICE"] == "/dev/ttyUSB0"
    assert command.environment["RATE"] == "10"
    assert command.environment["PATH"] == f"{Path(sys.executable).parent}:/usr/bin"
    parts = ("send_goal", "cancel_goal", "get_result", "feedback", "status")
    assert list(remappings(node)) == [
        "joints:=/joints",
        "~/status:=/status",
        "move:=/move_arm",
        *(f"move/_action/{part}:=/move_arm/_action/{part}" for part in parts),
        "unlisted:=/listed",
    ]
    assert parameter_file(node) == dedent("""\
        "/robot/left/driver":
          ros__parameters:
            "rate": 10.0
            "name": "007: no"
            "gains": [1.0, 2.5]
            "enabled": true
        """)


@pytest.mark.parametrize(
    ("nodes", "namespace", "names"),
    [
        ("", "", ["__node:=driver"]),
        ("", ", namespace: left", ["__node:=driver", "__ns:=/left"]),
        (", nodes: [base]", "", []),
        (", nodes: [base]", ", namespace: left", ["__ns:=/left"]),
    ],
)
def test_names_that_the_system_gives_to_a_program(
    tmp_path: Path, nodes: str, namespace: str, names: list[str]
) -> None:
    driver = f"executable: {{command: [sh]{nodes}}}{namespace}"
    text = f"{{system: robot, nodes: {{driver: {{{driver}}}}}}}"
    node = system_of(text, tmp_path).nodes[0]
    assert node.executable is not None
    words = make_command(node, node.executable, LogLevel.WARN, {"PATH": "/bin:/usr/bin"}).words
    assert [word for word in words if word.startswith("__")] == names


@pytest.mark.parametrize(
    ("executable", "problem"),
    [
        ("command: [./nowhere.sh]", "there is no program './nowhere.sh'"),
        ("command: [no_such_program]", "there is no program 'no_such_program'"),
        ("package: no_such_package, name: x", "package 'no_such_package' is not installed"),
        ("package: pytest, name: pytes", "no executable 'pytes'; did you mean 'pytest'"),
    ],
)
def test_programs_that_do_not_exist(executable: str, problem: str, tmp_path: Path) -> None:
    text = f"system: arm\nnodes: {{driver: {{executable: {{{executable}}}}}}}"
    node = system_of(text, tmp_path).nodes[0]
    assert node.executable is not None
    with pytest.raises(NotRunnable, match=problem):
        make_command(node, node.executable, LogLevel.INFO, {"PATH": "/usr/bin"})
