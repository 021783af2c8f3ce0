"""What ``compose import launch`` makes of the report on a launch file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
import yaml

from composer.base.diagnostics import Severity
from composer.bridges.importing.launch_file import describe_launch_file
from composer.bridges.importing.writing import write_parameters, write_system
from composer.launch.parameter_values import parameter_values
from tests.unit.support.checking import load_project

PARAMETERS = """\
/**: {ros__parameters: {use_sim_time: true}}
/**: {driver: {ros__parameters: {opencr: {id: 200}}}}
base: {ros__parameters: {rate: 5.0, qos_overrides./odom.publisher.depth: 3}}
local_costmap: {local_costmap: {ros__parameters: {radius: 0.22, text: a}}}
"""


def node(name: str | None = "base", **changes: Any) -> dict[str, Any]:
    process = {"left_out": [], "cwd": None, "ends_launch": False} | changes.pop("process", {})
    found: dict[str, Any] = {"name": name, "namespace": "/", "package": "p"}
    found |= {"executable": "program", "arguments": [], "ros_arguments": [], "environment": {}}
    found |= {"remappings": {}, "lifecycle": False, "note": "", "parameters": {}}
    return found | {"sections": {}, "problems": []} | changes | {"process": process}


def report(*nodes: dict[str, Any], left_out: Sequence[str] = ()) -> dict[str, Any]:
    """Return the report of one visit."""
    visit = {"values": {}, "nodes": [dict(item) for item in nodes], "left_out": left_out}
    return {"arguments": [], "visits": [visit], "base": list(nodes), "resolved": {}}


def described(*nodes: dict[str, Any]) -> tuple[dict[str, Any], tuple[str, ...]]:
    found = describe_launch_file("s", "f.launch.py", (), report(*nodes))
    return yaml.safe_load(write_system(found))["nodes"], found.left_out


LIMITED = "respawn without a limit (of /base): a restart is limited by 'max_attempts'"


def restarted(backoff_ms: int, **restart: int) -> dict[str, Any]:
    restart = {"backoff_ms": backoff_ms, "backoff_max_ms": backoff_ms, **restart}
    return {"lifecycle": {"on_failure": "restart", "restart": restart}}


@pytest.mark.parametrize(
    ("changes", "expected", "left_out"),
    [
        (
            {"process": {"respawn_delay": 2.0, "respawn_max_retries": 3}},
            restarted(2000, max_attempts=3),
            (),
        ),
        ({"process": {"respawn_delay": 0.0, "respawn_max_retries": -1}}, restarted(0), (LIMITED,)),
        ({"process": {"ends_launch": True}}, {"lifecycle": {"on_failure": "shutdown"}}, ()),
        ({"process": {"cwd": "/tmp"}}, {"executable": {"working_directory": "/tmp"}}, ()),
        (
            {"process": {"sigterm_timeout": 9.0, "sigkill_timeout": 0.0015}},
            {"executable": {"sigterm_timeout_ms": 9000, "sigkill_timeout_ms": 1.5}},
            (),
        ),
        ({"process": {"left_out": ["prefix: nice"]}}, {}, ("prefix: nice (of /base)",)),
        ({"ros_arguments": ["--log-level", "DEBUG"]}, {"log_level": "debug"}, ()),
        (
            {"arguments": ["-v"], "ros_arguments": ["--log-level", "rcl:=debug"]},
            {"executable": {"arguments": ["-v", "--ros-args", "--log-level", "rcl:=debug", "--"]}},
            (),
        ),
    ],
)
def test_options(
    changes: dict[str, Any], expected: dict[str, Any], left_out: tuple[str, ...]
) -> None:
    nodes, listed = described(node(**changes))
    executable = {"package": "p", "name": "program"} | expected.pop("executable", {})
    assert (nodes["base"], listed) == ({"executable": executable, **expected}, left_out)


def test_nodes_without_a_name_and_with_that_of_another_have_a_free_one() -> None:
    nodes, left_out = described(
        node("program"), node(None), node(None, executable="2 wheels.py"), node("program")
    )
    names = {name: item["executable"].get("nodes") for name, item in nodes.items()}
    assert names == {"program": None, "program_2": [], "_2_wheels": [], "program_3": None}
    assert left_out == ("the name 'program' of a second node: it is 'program_3' here",)


def test_components_name_their_containers() -> None:
    component = {"package": "demo", "plugin": "demo::Camera"}
    nodes, left_out = described(
        node("box", namespace="/a"),
        node("camera", component=component, container=("/a", "box")),
        node(None, executable="Camera", component=component, container=("/", "other")),
    )
    assert nodes == {
        "box": {"namespace": "/a", "executable": {"package": "p", "name": "program"}},
        "camera": {"component": component, "container": "box"},
        "Camera": {"component": component, "container": "other"},
        "other": {"external": True},
    }
    assert not left_out


def test_what_is_written_is_valid_and_has_the_parameters_of_inner_nodes(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(PARAMETERS)
    sources = [(str(tmp_path / "robot.yaml"), True), ("speed:=2", False)]
    items = [
        node("base", **parameter_values(sources, "/base")),
        node(None, **parameter_values(sources, "/<node_name_unspecified>")),
    ]
    found = describe_launch_file("s", "f.launch.py", (), report(*items))
    parameters = write_parameters(found)
    files = {"s.yaml": write_system(found, "s_parameters.yaml"), "s_parameters.yaml": parameters}
    result = load_project(tmp_path, files)
    assert [item for item in result.diagnostics if item.severity is not Severity.INFO] == []
    assert yaml.safe_load(parameters) == {
        "/**/driver": {"ros__parameters": {"use_sim_time": True, "opencr.id": 200, "speed": 2}},
        "/local_costmap/local_costmap": {
            "ros__parameters": {"use_sim_time": True, "radius": 0.22, "text": "a", "speed": 2}
        },
    }
    base, program = result.system.nodes
    assert {item.name.value: item.value.value for item in base.parameters if item.value} == {
        "use_sim_time": True,
        "rate": 5.0,
        "qos_overrides./odom.publisher.depth": 3,
        "speed": 2,
    }
    assert program.keeps_names


def test_the_nodes_of_a_launch_file_are_executables() -> None:
    item = node(
        None,
        namespace="/a",
        executable="listener.py",
        arguments=["-v"],
        remappings={"x": "/y"},
        parameters={"rate": 2, "gain.1": 16, "empty": []},
        environment={"A": "b"},
        lifecycle=True,
        note="after 3 s",
    )
    found = describe_launch_file("s", "r.launch.py", ["a:=b"], report(item, left_out=["x"]))
    assert (
        write_system(found)
        == """\
# Imported by 'compose import launch r.launch.py a:=b'.
# A launch file does not show topics, services and actions, so the nodes have no ports.
# To add them, start it, and copy the ports from the output of 'compose import live'.
#
# Left out:
# - x
# - parameter empty of /a/listener: its type is not known
system: s
nodes:
  # Started after 3 s by the launch file.
  # The launch file does not name its nodes; list them under 'nodes'.
  listener:
    namespace: /a
    executable:
      package: p
      name: listener.py
      nodes: []
      arguments: ["-v"]
      environment: {A: b}
      lifecycle: managed
    parameters: {rate: {type: integer, default: 2}, gain.1: {type: integer, default: 16}}
    remappings: {x: /y}
"""
    )


def test_sections_are_for_names_that_the_launch_file_does_not_give() -> None:
    items = [
        node("base", sections={"/wheel": {"a": 1, "map": "m"}, "/arm": {"b": 2}}),
        node("arm", sections={"/base": {"c": 3}, "/wheel": {"a": 1}}),
        node(None, executable="wheel", sections={"/wheel": {"a": 1}, "/base": {"c": 3}}),
    ]
    found = describe_launch_file("s", "f.launch.py", (), report(*items))
    assert [item.name for item in found.nodes] == ["base", "arm", "wheel"]
    assert found.sections == {"/wheel": {"a": 1}}
    assert found.left_out == ("parameters of /wheel in some programs only: map",)
