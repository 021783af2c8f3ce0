"""Parameters reach nodes that do not declare them, as ``ros2 run --params-file`` passes them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node as RosNode
from rclpy.parameter import Parameter as RosParameter

from composer.loading import load
from composer.model import Node
from composer.model.names import split_node_name
from composer.runtime.children.command_line import parameter_file
from composer.runtime.node.parameters import ros_parameters

#: Types, nested names, names with slashes, repeated names, and wildcards in any order.
FIRST = """\
/robot/arm:
  ros__parameters:
    a: 1
    gains: {p: 2.0, i: {max: 1e3, min: -0.5}}
    qos_overrides: {/joint_states: {publisher: {depth: 3, reliability: best_effort}}}
    "qos_overrides./tf.subscription.depth": 7
    texts: [a, "", 'yes', "1.0", "q\\"\\\\ü: #"]
    flags: [on, no, TRUE]
    numbers: [0x10, -3, 9223372036854775807]
    doubles: [1.0, .nan, -.inf, 1e-300]
    null: null
    "\U0001f916": "\U0001f916"
    "odd name/-": !!str 5
    start_type_description_service: false
/**: {ros__parameters: {a: 2, use_sim_time: true, everywhere: here}}
robot: {arm: {ros__parameters: {b: one}}, inner: {node: {ros__parameters: {c: 1, a: 5}}}}
/*/arm: {ros__parameters: {d: first}}
"""
SECOND = """\
/robot/*: {ros__parameters: {a: 3, e: 2}}
/**/node: {ros__parameters: {c: 4.5}}
/other: {ros__parameters: {f: 1}}
"""
SYSTEM = """\
system: robot
namespace: robot
parameter_files: [first.yaml, second.yaml]
nodes:
  renamed: {{name: arm, {}}}
  kept: {{executable: {{command: [python3, -V], nodes: [base, inner/node]}}}}
  other: {{external: true, namespace: /}}
"""
PROGRAM = "executable: {command: [python3, -V]}"


@pytest.fixture
def context() -> Iterator[Context]:
    context = Context()
    rclpy.init(args=[], context=context)
    yield context
    rclpy.shutdown(context=context)


def read_by(context: Context, full_name: str, *files: Path) -> dict[str, Any]:
    """Return the values that rclpy reads from the files for a node of that name."""
    namespace, name = split_node_name(full_name)
    node = RosNode(
        name,
        namespace=namespace,
        context=context,
        cli_args=["--ros-args", *(word for file in files for word in ("--params-file", str(file)))],
        start_parameter_services=False,
        enable_rosout=False,
    )
    overrides = node._parameter_overrides
    node.destroy_node()
    return shown(overrides)


def shown(values: dict[str, RosParameter]) -> dict[str, Any]:
    return {name: (item.type_.name, repr(item.value)) for name, item in values.items()}


def node_of(folder: Path, name: str, implementation: str) -> Node:
    (folder / "first.yaml").write_text(FIRST, encoding="utf-8")
    (folder / "second.yaml").write_text(SECOND, encoding="utf-8")
    system = folder / "system.yaml"
    system.write_text(SYSTEM.format(implementation), encoding="utf-8")
    loaded = load(system)
    assert [item.message for item in loaded.diagnostics if item.severity.value == "error"] == []
    assert loaded.system is not None
    node = loaded.system.node(name)
    assert node is not None
    return node


@pytest.mark.parametrize(
    ("name", "full_name"),
    [
        ("renamed", "/robot/arm"),
        ("renamed", "/other"),  # a node of its program with a name of its own
        ("renamed", "/elsewhere"),
        ("kept", "/robot/base"),
        ("kept", "/robot/inner/node"),
        ("kept", "/other"),
    ],
)
def test_programs(name: str, full_name: str, tmp_path: Path, context: Context) -> None:
    node = node_of(tmp_path, name, PROGRAM)
    passed = tmp_path / "passed.yaml"
    passed.write_text(parameter_file(node), encoding="utf-8")
    expected = read_by(context, full_name, tmp_path / "first.yaml", tmp_path / "second.yaml")
    assert read_by(context, full_name, passed) == expected


def test_classes(tmp_path: Path, context: Context) -> None:
    node = node_of(tmp_path, "renamed", "class: 'zzz:Arm'")
    values = ros_parameters((*node.parameters, *node.undeclared_parameters))
    files = (tmp_path / "first.yaml", tmp_path / "second.yaml")
    assert shown(values) == read_by(context, "/robot/arm", *files)
