"""QoS overrides of a node of ours against rclpy's: parameters, and QoS in the ROS graph."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.publisher import Publisher
from rclpy.qos import QoSPolicyKind
from rclpy.qos_overriding_options import QoSOverridingOptions, _get_allowed_policies
from rclpy.subscription import Subscription
from std_msgs.msg import String

from composer.model import PortKind
from composer.model.qos_overrides import overridable_policies
from tests.ros.support.in_process import Peer, running, wait_until

#: Not supported here: all topics are topics of ROS. INVALID stands for none.
LEFT_OUT = {QoSPolicyKind.AVOID_ROS_NAMESPACE_CONVENTIONS, QoSPolicyKind.INVALID}
VALUES = {
    "history": "keep_all",
    "depth": 4,
    "reliability": "best_effort",
    "durability": "transient_local",
    "deadline": 2_500_000_000,
    "lifespan": 3_000_000_000,
    "liveliness": "manual_by_topic",
    "liveliness_lease_duration": 4_000_000_000,
}
SYSTEM = """
system: overridden
nodes:
  ours:
    parameters: {{{parameters}}}
    publishers: {{words: {{type: std_msgs/msg/String, external: true}}}}
    subscriptions: {{words_in: {{type: std_msgs/msg/String, topic: words, external: true}}}}
"""


def given() -> dict[str, Any]:
    return {
        f"qos_overrides./words.{kind}.{policy}": VALUES[policy]
        for kind in (PortKind.PUBLISHER, PortKind.SUBSCRIPTION)
        for policy in overridable_policies(kind)
    }


def theirs(peer: Peer) -> None:
    """Create the same endpoints with rclpy, in the node of the peer."""
    node = peer.node
    node._parameter_overrides = {name: Parameter(name, value=v) for name, v in given().items()}
    options = QoSOverridingOptions([kind for kind in QoSPolicyKind if kind not in LEFT_OUT])
    node.create_publisher(String, "words", 10, qos_overriding_options=options)
    node.create_subscription(String, "words", print, 10, qos_overriding_options=options)


@pytest.mark.parametrize(
    ("kind", "entity"), [(PortKind.PUBLISHER, Publisher), (PortKind.SUBSCRIPTION, Subscription)]
)
def test_the_policies_are_those_of_rclpy(kind: PortKind, entity: Any) -> None:
    allowed = _get_allowed_policies(entity)
    names = {policy.name.lower() for policy in allowed if policy not in LEFT_OUT}
    assert set(overridable_policies(kind)) == names


def test_all_policies_are_overridden_as_by_rclpy(tmp_path: Path, peer: Peer) -> None:
    theirs(peer)
    parameters = ", ".join(f"{name}: {value}" for name, value in given().items())
    with running(SYSTEM.format(parameters=parameters), tmp_path):
        node = peer.node
        wait_until(lambda: node.count_publishers("/words") == 2)
        wait_until(lambda: node.count_subscribers("/words") == 2)
        for ends in (
            node.get_publishers_info_by_topic("/words"),
            node.get_subscriptions_info_by_topic("/words"),
        ):
            first, second = (end.qos_profile for end in ends)
            assert first == second
        listed = peer.call(ListParameters, "/ours/list_parameters").result.names
        names = [name for name in listed if name.startswith("qos_overrides.")]
        request = GetParameters.Request(names=names)
        values = peer.call(GetParameters, "/ours/get_parameters", request).values
    assert dict(zip(names, map(parameter_value_to_python, values), strict=True)) == given()
