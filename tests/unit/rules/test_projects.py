"""Small projects: each mistake is reported once, where it is. Most are in ``projects.yaml``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

from composer.base.diagnostics import Severity
from composer.loading import load, load_files
from composer.loading.reported import collect_diagnostics, project_diagnostics
from tests.unit.interfaces.test_index import package, prefix
from tests.unit.support.checking import (
    diagnostics_in,
    diagnostics_of_each,
    load_project,
    places,
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
    found = {}
    for index, diagnostics in enumerate(diagnostics_of_each(files, folder)):
        lines = [f"{item.primary.file.path}:{item.primary.line}" for item in diagnostics]
        found[PROJECTS[index]["name"]] = [
            f"{line.removeprefix(f'{folder / str(index)}/').removeprefix('system.yaml:')} "
            f"{item.rule.name}".replace(f"_{index}.py", ".py")
            for line, item in zip(lines, diagnostics, strict=True)
        ]
    return found


@pytest.mark.parametrize("project", PROJECTS, ids=[project["name"] for project in PROJECTS])
def test_diagnostics(project: dict[str, Any], reported: dict[str, list[str]]) -> None:
    assert reported[project["name"]] == project["found"]


def test_a_node_type_alone_needs_no_connections_and_no_profiles(tmp_path: Path) -> None:
    repeater = """\
node: repeater
variables: {message_type: {description: The type.}}
parameters: {rate_hz: {type: double}}
subscriptions:
  input: {type: '${message_type}', qos: command, publish: {output: '{message}'}}
publishers:
  output: {type: '${message_type}', qos: command}
  beat: {type: std_msgs/msg/String, qos: %s, external: true}
timers: {tick: {rate_hz: 1, publish: {beat: {data: tick}}}}
"""
    assert load_project(tmp_path, {"repeater.yaml": repeater % "command"}).diagnostics == []
    assert load_project(tmp_path, {"nodes/repeater.yaml": repeater % "images"}).diagnostics == []
    # The systems that use it declare the profiles.
    node = "{type: repeater, variables: {message_type: std_msgs/msg/String}, "
    node += "parameters: {rate_hz: 1.0}, subscriptions: {input: {external: true}}, "
    system = f"system: demo\nnodes:\n  one: {node}publishers: {{output: {{external: true}}}}}}\n"
    profiles = "qos_profiles: {images: {depth: 1}}\n"
    assert load_project(tmp_path, {"demo.yaml": system + profiles}).diagnostics == []
    [diagnostic] = load_project(tmp_path, {"demo.yaml": system}).diagnostics
    assert diagnostic.rule.name == "undeclared-name"


def test_all_uses_of_a_renamed_field_are_labels_of_one_diagnostic(tmp_path: Path) -> None:
    port = "type: demo_msgs/msg/Zone, qos: state, external: true"
    log = 'log: "{message.zone}", when: message.zone != ""'
    files = {
        "a.yaml": f"system: demo\nnodes:\n  a: {{subscriptions: {{zone: {{{port}, {log}}}}}}}\n",
        "interfaces/demo_msgs/msg/Zone.msg": "string area\n",
        "interfaces/demo_msgs/package.xml": "<package><name>demo_msgs</name></package>",
        "composer.yaml": "interfaces: [interfaces]\n",
    }
    [found] = load_project(tmp_path, files).diagnostics
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
def test_a_wrong_value_of_a_loop(old: str, new: str, rule: str, text: str, tmp_path: Path) -> None:
    (tmp_path / "part.yaml").write_text(PART, encoding="utf-8")
    assert diagnostics_in(FLEET, tmp_path) == []
    [found] = diagnostics_in(FLEET.replace(old, new), tmp_path)
    assert (found.rule.name, found.primary.text) == (rule, text)


def test_a_package_that_is_missing_is_reported_once_with_all_uses(tmp_path: Path) -> None:
    files = {
        "a.yaml": "system: demo\nnodes:\n  drive:\n    behavior: drive:Drive\n    subscriptions:\n"
        "      grip: {type: arm_msgs/msg/Grip, qos: command, external: true}\n"
        "    clients: {move: {type: arm_msgs/srv/Move, external: true}}\n",
        "drive.py": "from arm_msgs.msg import Grip\nfrom arm_msgs.srv import Move\n\n\n"
        "class Drive:\n    def on_grip(self, message):\n        print(Grip, Move)\n",
    }
    [found] = load_project(tmp_path, files).diagnostics
    assert len(found.related) >= len(["the other import", "the port", "the client"])


@pytest.mark.parametrize("module", ["a", "z"], ids=["before the system", "after the system"])
def test_a_missing_package_is_an_error_in_files_of_any_name(module: str, tmp_path: Path) -> None:
    files = {
        "system.yaml": f"system: demo\nnodes:\n  turtle:\n    class: {module}:Turtle\n"
        "    subscriptions: {pose: {type: turtlesim/msg/Pose, external: true}}\n",
        f"{module}.py": "from rclpy.node import Node\nfrom turtlesim.msg import Pose\n\n\n"
        "class Turtle(Node):\n    def __init__(self):\n        super().__init__('turtle')\n"
        "        self.create_subscription(Pose, 'pose', print, 10)\n",
    }
    diagnostics = load_project(tmp_path, files).diagnostics
    [found] = [item for item in diagnostics if item.severity is Severity.ERROR]
    assert found.rule.name == "unknown-interface"
    assert found.hint == (
        "install the package 'turtlesim', or put its source into the folder 'interfaces'; "
        "did you mean 'geometry_msgs/msg/Pose'?"
    )


def test_a_missing_folder_of_node_types_is_a_warning(tmp_path: Path) -> None:
    files = {
        "other.yaml": "system: demo\nnodes: {motor: {on_activate: {log: x}}}\n",
        "system.yaml": "system: demo\nnodes: {motor: {type: motor}}\n",
        "composer.yaml": "nodes: [node_types]\n",
        "node_type/motor.yaml": "node: motor\non_activate: {log: x}\n",
    }
    [warning] = load_project(tmp_path, files).diagnostics
    assert (warning.severity, warning.hint) == (Severity.WARNING, "did you mean 'node_type'?")
    results = load_files([tmp_path / "system.yaml", tmp_path / "node_type" / "motor.yaml"])
    found = [*collect_diagnostics(results), *project_diagnostics(results)]
    assert [item.rule.name for item in found] == ["bad-setting", "unknown-node-type"]


PLANNERS = {
    "nodes/planner.yaml": "node: planner\non_activate: {log: ready}\n",
    "nodes/old_planner.yaml": "node: old_planner\non_activate: {log: ready}\n",
    "systems/pipeline.yaml": "system: pipeline\nnodes: {planner: {type: planner}}\n",
}
COMMENT = "# compose: ignore[unused-declaration] for other projects\n"


@pytest.mark.parametrize(
    ("changed", "loaded", "expected"),
    [
        pytest.param({}, [*PLANNERS], ["nodes/old_planner.yaml:1:7"], id="unused"),
        pytest.param(
            {"nodes/old_planner.yaml": "node: {old: planner}\n"}, [*PLANNERS], [], id="wrong name"
        ),
        pytest.param({}, [*PLANNERS][:2], [], id="without a system"),
        pytest.param(
            {"other/nodes/planner.yaml": PLANNERS["nodes/planner.yaml"]},
            ["other/nodes/planner.yaml", "systems/pipeline.yaml"],
            ["other/nodes/planner.yaml:1:7"],
            id="the same name elsewhere",
        ),
        pytest.param(
            {"nodes/old_planner.yaml": COMMENT + PLANNERS["nodes/old_planner.yaml"]},
            [*PLANNERS],
            [],
            id="ignored",
        ),
    ],
)
def test_a_node_type_that_no_system_uses_is_reported(
    changed: dict[str, str],
    loaded: list[str],
    expected: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    write_files(tmp_path, PLANNERS | changed)
    monkeypatch.chdir(tmp_path)
    found = project_diagnostics([load(Path(name)) for name in loaded])
    assert places(found) == [f"{place} unused-declaration" for place in expected]


@pytest.mark.parametrize(
    ("files", "command"),
    [([], "compose interface build arm_interfaces   or: "), (["pyproject.toml"], "pip install ")],
)
def test_an_interface_that_has_changed_since_it_was_built_is_an_error_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, files: list[str], command: str
) -> None:
    system = """\
system: demo
nodes:
  hand:
    publishers: {grip: {type: arm_interfaces/msg/Grip, qos: command, external: true}}
    subscriptions: {want: {type: arm_interfaces/msg/Grip, qos: command, external: true, log: x}}
"""
    source = package(tmp_path / "interfaces" / "arm", "arm_interfaces", msg_Grip="float64 force")
    for name in files:
        (source / name).touch()
    prefix(tmp_path / "install", "arm_interfaces", msg_Grip="float32 force")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "install"))
    [diagnostic] = load_project(tmp_path, {"demo.yaml": system}).diagnostics
    assert diagnostic.rule.name == "outdated-interface"
    assert diagnostic.message == (
        "'arm_interfaces/msg/Grip' has changed since the package 'arm_interfaces' was built"
    )
    assert (diagnostic.hint or "").startswith(command)
    (source / "msg" / "Grip.msg").write_text("float32 force # in newtons")
    assert load(tmp_path / "demo.yaml").diagnostics == []
