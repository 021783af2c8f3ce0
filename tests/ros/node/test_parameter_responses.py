"""Parameter services respond as rclpy's, on executors of every kind."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from rcl_interfaces.msg import Parameter, ParameterDescriptor, ParameterValue
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.node import Node

from tests.ros.support.in_process import Peer, running

SYSTEM = """
system: served
nodes:
  subject:
    parameters:
      speed: {type: double, default: 1.5, maximum: 5.0}
      label: {type: string, default: here, read_only: true}
      arm.joint.count: {type: integer, default: 3}
"""


def plain_node(peer: Peer) -> Node:
    """Return a node of rclpy with the same parameters."""
    node = peer.join("plain")
    node.declare_parameter("speed", 1.5)
    node.declare_parameter("label", "here", ParameterDescriptor(read_only=True))
    node.declare_parameter("arm.joint.count", 3)
    return node


def change(name: str, kind: int, **fields: Any) -> Parameter:
    return Parameter(name=name, value=ParameterValue(type=kind, **fields))


REQUESTS: list[tuple[Any, str, dict[str, Any]]] = [
    (GetParameters, "get_parameters", {"names": ["speed", "arm.joint.count", "speed"]}),
    (GetParameters, "get_parameters", {"names": ["speed", "missing"]}),
    (GetParameters, "get_parameters", {"names": []}),
    (GetParameterTypes, "get_parameter_types", {"names": ["label", "use_sim_time"]}),
    (GetParameterTypes, "get_parameter_types", {"names": ["missing"]}),
    (DescribeParameters, "describe_parameters", {"names": ["use_sim_time"]}),
    (DescribeParameters, "describe_parameters", {"names": ["missing"]}),
    (ListParameters, "list_parameters", {"prefixes": ["arm", "arm"], "depth": 2}),
    (ListParameters, "list_parameters", {"prefixes": ["arm"], "depth": 1}),
    (ListParameters, "list_parameters", {"prefixes": ["missing"]}),
    (SetParameters, "set_parameters", {"parameters": [change("speed", 3, double_value=2.5)]}),
    (SetParameters, "set_parameters", {"parameters": [change("missing", 3, double_value=2.5)]}),
    (SetParameters, "set_parameters", {"parameters": [change("label", 4, string_value="x")]}),
    (SetParameters, "set_parameters", {"parameters": []}),
    (
        SetParametersAtomically,
        "set_parameters_atomically",
        {"parameters": [change("speed", 3, double_value=3.5), change("missing", 1)]},
    ),
]


@pytest.mark.parametrize("kind", ["events", "multi_threaded"])
def test_responses_are_those_of_rclpy(tmp_path: Path, peer: Peer, kind: str) -> None:
    with running(f"{SYSTEM}executors: {{default: {{kind: {kind}}}}}", tmp_path):
        compare_responses(peer, plain_node(peer))


def compare_responses(peer: Peer, plain: Node) -> None:
    own = plain.get_fully_qualified_name()
    for kind, name, fields in REQUESTS:
        request = kind.Request(**fields)
        expected = str(peer.call(kind, f"{own}/{name}", request)).replace(own, "/subject")
        assert str(peer.call(kind, f"/subject/{name}", request)) == expected, (name, fields)
