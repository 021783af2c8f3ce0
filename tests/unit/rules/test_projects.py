"""Small projects in ``projects.yaml``: each mistake is reported once, where it is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

from composer.base.diagnostics import Severity
from composer.loading import load, load_files
from composer.loading.reported import collect_diagnostics, project_diagnostics
from tests.unit.support.checking import (
    diagnostics_in,
    diagnostics_of_each,
    rules_broken,
    write_files,
)

PROJECTS = yaml.load(
    Path(__file__).with_name("projects.yaml").read_text(encoding="utf-8"), yaml.CSafeLoader
)


@pytest.fixture(scope="module")
def reported(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[str]]:
    """The place and the rule of each diagnostic, by project."""
    folder = tmp_path_factory.mktemp("projects")
    files = [
        {"system.yaml": project["system.yaml"]}
        | {name: text for name, text in project.items() if name not in ("name", "found")}
        for project in PROJECTS
    ]
    return {
        project["name"]: [
            f"{item.primary.file.path}:{item.primary.line} {item.rule.name}".removeprefix(
                f"{folder / str(index)}/"
            )
            .removeprefix("system.yaml:")
            .replace(f"_{index}.py", ".py")
            for item in found
        ]
        for index, (project, found) in enumerate(
            zip(PROJECTS, diagnostics_of_each(files, folder), strict=True)
        )
    }


@pytest.mark.parametrize("project", PROJECTS, ids=[project["name"] for project in PROJECTS])
def test_diagnostics(project: dict[str, Any], reported: dict[str, list[str]]) -> None:
    assert reported[project["name"]] == project["found"]


def test_a_node_type_alone_needs_no_connections(tmp_path: Path) -> None:
    text = (
        "node: relay\nvariables: {message_type: {description: The type.}}\n"
        "parameters: {rate_hz: {type: double}}\n"
        "subscriptions:\n"
        "  input: {type: '${message_type}', qos: command, publish: {output: '{message}'}}\n"
        "publishers: {output: {type: '${message_type}', qos: command}}\n"
    )
    write_files(tmp_path, {"relay.yaml": text})
    assert load(tmp_path / "relay.yaml").diagnostics == []


def test_all_uses_of_a_renamed_field_are_labels_of_one_diagnostic(tmp_path: Path) -> None:
    write_files(
        tmp_path,
        {
            "interfaces/demo_msgs/msg/Zone.msg": "string area\n",
            "interfaces/demo_msgs/package.xml": "<package><name>demo_msgs</name></package>",
            "composer.yaml": "interfaces: [interfaces]\n",
        },
    )
    port = "type: demo_msgs/msg/Zone, qos: state, external: true"
    log = 'log: "{message.zone}", when: message.zone != ""'
    text = f"system: demo\nnodes:\n  a: {{subscriptions: {{zone: {{{port}, {log}}}}}}}\n"
    [found] = diagnostics_in(text, tmp_path)
    assert found.message == "demo_msgs/msg/Zone has no field 'zone'"
    assert [label.message for label in found.related] == ["here too"]


def test_a_port_in_the_wrong_section_is_reported_where_it_is_used(tmp_path: Path) -> None:
    server = "services: {ask: {type: std_srvs/srv/Trigger, respond: {success: true}}}"
    files = {
        "system.yaml": f"system: demo\nnodes:\n  server: {{{server}}}\n  user: {{type: user}}\n"
        "connections:\n  - {service: /ask, server: server.ask, clients: user.ask}\n",
        "nodes/user.yaml": f"node: user\n{server}\n"
        "timers: {tick: {period_ms: 100, call: {ask: {}}}}\n",
    }
    write_files(tmp_path, files)
    found = collect_diagnostics([load(tmp_path / name) for name in files])
    assert [item.rule.name for item in found] == ["wrong-port-kind", "wrong-port-kind"]


PART = """\
system: part
arguments: {unit: a}
nodes:
  driver:
    publishers: {odom: {type: std_msgs/msg/String, qos: command, required: false}}
    services: {stop: {type: std_srvs/srv/Trigger, external: true, respond: {}}}
    timers: {tick: {period_ms: 100, publish: {odom: {data: "${unit}"}}}}
"""
FLEET = """\
system: fleet
include:
  - {file: part.yaml, for_each: {unit: [a, b]}, prefix: "${unit}_", namespace: "${unit}",
     arguments: {unit: "${unit}"}}
nodes:
  monitor:
    subscriptions:
      a: {type: std_msgs/msg/String, qos: command, log: a}
      b: {type: std_msgs/msg/String, qos: command, log: b}
connections:
  - {topic: "${unit}/odom", for_each: {unit: [a, b]}, from: "${unit}_driver.odom",
     to: "monitor.${unit}"}
"""


@pytest.mark.parametrize(
    ("old", "new", "rule", "text"),
    [
        ("{unit: [a, b]}, prefix", "{unit: [a, b, a]}, prefix", "duplicate-name", "a"),
        ("{unit: [a, b]}, from", "{unit: [a, b, b]}, from", "duplicate-name", "b"),
        ("[a, b]}, prefix", "[a, b, 3c]}, prefix", "invalid-include", "3c"),
        ("[a, b]}, from", "[a, b, c]}, from", "unknown-node", "${unit}_driver.odom"),
        ('namespace: "${unit}"', 'namespace: "${unti}"', "unknown-variable", "${unti}"),
        # durability: the file of the system is wrong, not the included one
        ("b: {type: std_msgs/msg/String, qos: command", "b: {type: std_msgs/msg/String, qos: state",
         "qos-incompatible", "state"),
    ],
)  # fmt: skip
def test_a_wrong_value_of_a_loop_is_reported_once(
    old: str, new: str, rule: str, text: str, tmp_path: Path
) -> None:
    (tmp_path / "part.yaml").write_text(PART, encoding="utf-8")
    assert diagnostics_in(FLEET, tmp_path) == []
    [found] = diagnostics_in(FLEET.replace(old, new), tmp_path)
    assert (found.rule.name, found.primary.text) == (rule, text)


def test_a_type_that_contradicts_the_class_is_reported_once(tmp_path: Path) -> None:
    (tmp_path / "camera.py").write_text(
        "from rclpy.node import Node\nfrom std_msgs.msg import String\n\n\nclass Camera(Node):\n"
        "    def __init__(self):\n        super().__init__('camera')\n"
        "        self.create_publisher(String, 'text', 10)\n",
        encoding="utf-8",
    )
    text = (
        "system: demo\nnodes:\n"
        "  camera: {class: 'camera:Camera', publishers: {text: {type: std_msgs/msg/Int32}}}\n"
        "  sink: {subscriptions: {text: {type: std_msgs/msg/String, log: a}}}\n"
    )
    assert "class-port" in rules_broken(text, tmp_path)
    assert "type-mismatch" not in rules_broken(text, tmp_path)


def test_a_package_that_is_missing_is_reported_once_with_all_uses(tmp_path: Path) -> None:
    (tmp_path / "drive.py").write_text(
        "from arm_msgs.msg import Grip\nfrom arm_msgs.srv import Move\n\n\nclass Drive:\n"
        "    def on_grip(self, message):\n        print(Grip, Move)\n",
        encoding="utf-8",
    )
    text = (
        "system: demo\nnodes:\n  drive:\n    behavior: drive:Drive\n    subscriptions:\n"
        "      grip: {type: arm_msgs/msg/Grip, qos: command, external: true}\n"
        "    clients: {move: {type: arm_msgs/srv/Move, external: true}}\n"
    )
    [found] = diagnostics_in(text, tmp_path)
    assert len(found.related) >= len(["the other import", "the port", "the client"])


@pytest.mark.parametrize("module", ["a", "z"], ids=["before the system", "after the system"])
def test_a_missing_package_of_a_port_is_an_error_in_files_of_any_name(
    module: str, tmp_path: Path
) -> None:
    code = (
        "from rclpy.node import Node\nfrom turtlesim.msg import Pose\n\n\nclass Turtle(Node):\n"
        "    def __init__(self):\n        super().__init__('turtle')\n"
        "        self.create_subscription(Pose, 'pose', print, 10)\n"
    )
    (tmp_path / f"{module}.py").write_text(code, encoding="utf-8")
    text = (
        f"system: demo\nnodes:\n  turtle:\n    class: {module}:Turtle\n    subscriptions:\n"
        "      pose: {type: turtlesim/msg/Pose, external: true}\n"
    )
    found = max(diagnostics_in(text, tmp_path), key=lambda item: item.severity is Severity.ERROR)
    assert found.rule.name == "unknown-interface"
    assert found.hint == (
        "install the package 'turtlesim', or put its source into the folder 'interfaces'; "
        "did you mean 'geometry_msgs/msg/Pose'?"
    )


def test_a_missing_folder_of_node_types_is_a_warning(tmp_path: Path) -> None:
    (tmp_path / "composer.yaml").write_text("nodes: [node_types]\n", encoding="utf-8")
    (tmp_path / "node_type").mkdir()
    (tmp_path / "node_type" / "motor.yaml").write_text("node: motor\non_activate: {log: x}\n")
    (tmp_path / "system.yaml").write_text("system: demo\nnodes: {motor: {type: motor}}\n")
    (tmp_path / "other.yaml").write_text("system: demo\nnodes: {motor: {on_activate: {log: x}}}\n")
    results = load_files([tmp_path / "system.yaml", tmp_path / "node_type" / "motor.yaml"])
    found = [*collect_diagnostics(results), *project_diagnostics(results)]
    assert [item.rule.name for item in found] == ["bad-setting", "unknown-node-type"]
    [warning] = load(tmp_path / "other.yaml").diagnostics
    assert (warning.severity, warning.hint) == (Severity.WARNING, "did you mean 'node_type'?")
