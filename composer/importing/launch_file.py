"""Describe the nodes of a launch file, as :mod:`composer.launch.visitor` reports them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from composer.importing.found import FoundNode, FoundParameter, FoundSystem
from composer.names import join_node_name, parameter_name_problem
from composer.resolve.declarations.parameters import rclpy_type
from composer.tree import Plain

_DEFAULT_NAME = "node"
_PORTS = (
    "A launch file does not show topics, services and actions, so the nodes have no ports.",
    "To add them, start it, and copy the ports from the output of 'compose import live'.",
)


def describe_launch_file(
    name: str, path: str, arguments: Iterable[str], found: Mapping[str, Any]
) -> FoundSystem:
    """Return the system that a launch file starts with these arguments."""
    left_out = list(found["left_out"])
    nodes = tuple(_node(item, left_out) for item in found["nodes"])
    command = " ".join(["compose import launch", path, *arguments])
    return FoundSystem(name, nodes, (f"Imported by '{command}'.", *_PORTS), tuple(left_out))


def _node(item: Mapping[str, Any], left_out: list[str]) -> FoundNode:
    program = Path(item["executable"]).name
    name = item["name"]
    shown = f"{item['package'] or ''} {program}".strip()
    if name is None:
        name = "".join(
            character if character.isalnum() else "_" for character in program.partition(".")[0]
        )
        left_out.append(f"name of {shown}: the launch file does not set it; it is '{name}' here")
    namespace = item["namespace"]
    keys: dict[str, Plain] = {"executable": _executable(item)}
    if item["respawn"]:
        keys["lifecycle"] = {"on_failure": "restart"}
    if item["ros_arguments"]:
        left_out.append(f"--ros-args of {shown}: {' '.join(item['ros_arguments'])}")
    full_name = join_node_name(namespace, name)
    values: dict[str, Plain] = item["parameters"]
    left_out += item["problems"]
    return FoundNode(
        name=name or _DEFAULT_NAME,
        namespace=namespace,
        keys=keys,
        parameters=tuple(_declared(values, full_name, left_out)),
        remappings=item["remappings"],
        comments=(f"Started {item['note']} by the launch file.",) if item["note"] else (),
    )


def _executable(item: Mapping[str, Any]) -> Plain:
    if item["package"]:
        found: dict[str, Plain] = {"package": item["package"], "name": item["executable"]}
    else:
        found = {"command": [item["executable"]]}
    if item["arguments"]:
        found["arguments"] = list(item["arguments"])
    if item["environment"]:
        found["environment"] = dict(item["environment"])
    if item["lifecycle"]:
        found["lifecycle"] = "managed"
    return found


def _declared(
    values: Mapping[str, Plain], full_name: str, left_out: list[str]
) -> Iterable[FoundParameter]:
    for name, value in values.items():
        kind = rclpy_type(value)
        if kind is None or parameter_name_problem(name):
            left_out.append(f"parameter {name} of {full_name}: its type is not known")
        else:
            yield FoundParameter(name, kind, value)
