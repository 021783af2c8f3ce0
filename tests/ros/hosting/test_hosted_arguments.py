"""Names and parameters reach a class exactly as ``ros2 run --ros-args`` would set them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.parameter import parameter_value_to_python
from rclpy.qos import ReliabilityPolicy

from tests.ros.support.external_processes import soon_missed
from tests.ros.support.in_process import Peer, running, wait_until

CLASSES = "tests.ros.support.node_classes"
PROGRAM = f"""
import rclpy
from {CLASSES} import Configured
rclpy.init()
rclpy.spin(Configured())
"""
RENAMED = ("__node:=robot_node", "__ns:=/fleet/one", "scan:=/all/scan", "start:=begin")
SET = (
    "rate:=2.5",
    "count:=3",
    "label:=front",
    "enabled:=true",
    "gains:=[1.0,2.5]",
    'names:=["a","b"]',
    "use_sim_time:=true",
)
ARGUMENTS = [
    "--ros-args",
    *(word for rule in (*RENAMED, "~/private:=open") for word in ("-r", rule)),
    *(word for value in SET for word in ("-p", value)),
]
SYSTEM = f"""
system: one
namespace: /fleet/one
nodes:
  robot_node:
    class: {CLASSES}:Configured
    remappings: {{robot_node:scan: /all/scan, "rosservice://start": begin, ~/private: open}}
    parameters:
      rate: {{type: double, default: 2.5}}
      count: {{type: integer, default: 3}}
      label: {{type: string, default: front}}
      enabled: {{type: bool, default: true}}
      gains: {{type: double_array, default: [1, 2.5]}}
      names: {{type: string_array, default: [a, b]}}
      use_sim_time: {{type: bool, default: true}}
"""
NAME, NAMESPACE = "robot_node", "/fleet/one"
#: The lifecycle of the composer, which a plain node does not have.
LIFECYCLE = ("change_state", "get_state", "available", "transition", "/rosout", "/clock")


def described(peer: Peer) -> dict[str, Any]:
    """Return what other nodes see of the node."""
    node = peer.node
    full_name = f"{NAMESPACE}/{NAME}"
    wait_until(lambda: node.count_services(f"{full_name}/list_parameters") == 1)
    wait_until(lambda: (NAME, NAMESPACE) in node.get_node_names_and_namespaces())
    wait_until(lambda: node.count_publishers("/all/scan") == 1)
    listed = peer.call(ListParameters, f"{full_name}/list_parameters").result.names
    names = sorted(name for name in listed if name != "start_type_description_service")
    values = peer.call(
        GetParameters, f"{full_name}/get_parameters", GetParameters.Request(names=names)
    ).values
    return {
        "parameters": dict(zip(names, map(parameter_value_to_python, values), strict=True)),
        "publishers": shown(node.get_publisher_names_and_types_by_node(NAME, NAMESPACE)),
        "services": shown(node.get_service_names_and_types_by_node(NAME, NAMESPACE)),
    }


def shown(found: list[tuple[str, list[str]]]) -> list[tuple[str, str]]:
    return sorted(
        (name, kinds[0]) for name, kinds in found if not any(part in name for part in LIFECYCLE)
    )


def test_a_class_has_the_names_and_parameters_of_ros2_run(tmp_path: Path, peer: Peer) -> None:
    command = [sys.executable, "-c", PROGRAM, *ARGUMENTS]
    with subprocess.Popen(command, env={**os.environ, **soon_missed(tmp_path)}) as program:
        try:
            expected = described(peer)
        finally:
            program.send_signal(signal.SIGINT)
            try:
                program.wait(60.0)
            except subprocess.TimeoutExpired:
                program.kill()
    wait_until(lambda: peer.node.count_publishers("/all/scan") == 0)
    assert expected["parameters"]["gains"] == [1.0, 2.5]
    with running(SYSTEM, tmp_path) as system:
        assert system.node("robot_node").state == "active"
        assert described(peer) == expected


def test_a_class_gets_what_it_does_not_declare_in_yaml(tmp_path: Path, peer: Peer) -> None:
    """From parameter files, also by wildcards and with slashes in names."""
    (tmp_path / "robot.yaml").write_text(
        "/fleet/**: {ros__parameters: {gains: {p: 2}, start_type_description_service: true,"
        " qos_overrides: {/fleet/one/other: {publisher: {reliability: best_effort}}}}}\n",
        encoding="utf-8",
    )
    text = f"""
system: one
namespace: /fleet/one
parameter_files: [robot.yaml]
nodes:
  robot_node: {{class: "{CLASSES}:Configured", remappings: {{scan: /all/scan}}}}
"""
    with running(text, tmp_path):
        values = described(peer)["parameters"]
        (other,) = peer.node.get_publishers_info_by_topic("/fleet/one/other")
    assert values["gains.p"] == 2
    assert values["qos_overrides./fleet/one/other.publisher.reliability"] == "best_effort"
    assert other.qos_profile.reliability is ReliabilityPolicy.BEST_EFFORT
