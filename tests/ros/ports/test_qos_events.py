"""QoS events: logged with the names of nodes, and counted."""

from __future__ import annotations

import json
import re
import time
from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Int64, String

from tests.ros.support.commands import output_of
from tests.ros.support.in_process import Peer, RunningSystem, running, wait_until

BEST_EFFORT = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
KINDS = ["events", "multi_threaded"]


def counts(system: RunningSystem, node: str) -> dict[str, int]:
    return dict(system.node(node).statistics.qos_events)


def publishers(system: RunningSystem, name: str, topic: str) -> list[str]:
    """Return the names of the publishers that a node of the system has discovered."""
    node = system.ros_node(name)
    return [end.node_name for end in node.get_publishers_info_by_topic(topic)]


def lines(system: RunningSystem, part: str) -> list[str]:
    return [line for line in system.log() if part in line]


def qos_events_of(arrays: list[DiagnosticArray]) -> list[str]:
    return [
        value.value
        for message in tuple(arrays)
        for status in message.status
        for value in status.values
        if value.key == "qos_events"
    ]


ENDS = """
system: ends
executors: {{default: {{kind: {kind}}}}}
nodes:
  a:
    publishers: {{output: {{type: std_msgs/msg/String, external: true, qos: command}}}}
    subscriptions: {{input: {{type: std_msgs/msg/String, external: true, qos: command}}}}
"""


@pytest.mark.parametrize("kind", KINDS)
def test_incompatible_external_nodes_are_named_with_the_policy_and_counted(
    tmp_path: Path, peer: Peer, kind: str, capfd: pytest.CaptureFixture[str]
) -> None:
    with running(ENDS.format(kind=kind), tmp_path) as system:
        arrays = peer.listen(DiagnosticArray, "/diagnostics")
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        known = system.ros_node("a").get_node_names
        wait_until(lambda: peer.node.get_name() in known(), "the peer's name")
        peer.node.create_publisher(String, "/input", BEST_EFFORT)
        peer.node.create_subscription(String, "/output", lambda _: None, latched)
        name = peer.node.get_fully_qualified_name()
        received = system.wait_for_log("subscription 'input'")
        assert received == (
            f"subscription 'input' is incompatible with {name} on /input: reliability is "
            "best_effort there, reliable here; the publisher does not send lost messages again"
        )
        reached = system.wait_for_log("publisher 'output'")
        assert reached == (
            f"publisher 'output' is incompatible with {name} on /output: durability is "
            "transient_local there, volatile here; "
            "the publisher does not keep messages for late joiners"
        )
        assert counts(system, "a") == {"incompatible": 2}
        wait_until(lambda: "incompatible=2" in qos_events_of(arrays))
        listed = output_of("ps", "ends", "--json", "--timeout", "20")
    nodes = json.loads(listed)["systems"][0]["nodes"]
    assert [node["qos_events"] for node in nodes] == [{"incompatible": 2}]
    of_rclpy = capfd.readouterr().err
    assert not re.search(r"'/input', offering incompatible|\[a\].*incompatible QoS", of_rclpy)


def test_an_external_node_with_another_type_is_named(tmp_path: Path, peer: Peer) -> None:
    with running(ENDS.format(kind="events"), tmp_path) as system:
        odd = peer.join("odd")
        odd.create_publisher(Int64, "/input", 10)
        name = odd.get_fully_qualified_name()
        wait_until(lambda: publishers(system, "a", "/input") == [odd.get_name()], "its name")
        other = Peer()  # a participant has one type per topic
        try:
            # Fast DDS does not report types alone.
            other.node.create_publisher(String, "/input", BEST_EFFORT)
            system.wait_for_log("reliability is best_effort")
        finally:
            other.close()
        assert system.wait_for_log("its type is") == (
            f"subscription 'input' is incompatible with {name} on /input: its type is "
            "std_msgs/msg/Int64, not std_msgs/msg/String"
        )


LATCHED = """
system: latched
qos_profiles: {{latest: {{extends: state, lifespan_ms: {lifespan_ms}}}}}
nodes:
  talker:
    publishers: {{latest: {{type: std_msgs/msg/String, qos: latest}}}}
    subscriptions:
      say: {{type: std_msgs/msg/String, external: true, log: "said {{message.data}}",
            publish: {{latest: {{data: "{{message.data}}"}}}}}}
  listener:
    subscriptions:
      latest: {{type: std_msgs/msg/String, qos: latest, log: "received {{message.data}}"}}
"""


@pytest.mark.parametrize("away", [("deactivate", "cleanup"), ("deactivate",)])
@pytest.mark.parametrize(("lifespan_ms", "received"), [(300, ["received new"]), (60_000, None)])
def test_a_lifespan_applies_within_the_process(
    tmp_path: Path, peer: Peer, lifespan_ms: int, received: list[str] | None, away: tuple[str, ...]
) -> None:
    with running(LATCHED.format(lifespan_ms=lifespan_ms), tmp_path) as system:
        say = peer.publisher(String, "/say")
        system.change("listener", *away)
        say.publish(String(data="old"))
        system.wait_for_log("said old")
        over_s = time.monotonic() + 1.0
        wait_until(lambda: time.monotonic() > over_s, "the end of the lifespan")
        back = ("configure", "activate") if "cleanup" in away else ("activate",)
        system.change("listener", *back)
        wait_until(lambda: received is not None or lines(system, "received old"))

        def is_new_received() -> bool:
            """Publish until it arrives: on a busy machine the lifespan may end in transit."""
            say.publish(String(data="new"))
            return "received new" in system.log()

        wait_until(is_new_received)
        assert [*dict.fromkeys(lines(system, "received"))] == (
            received or ["received old", "received new"]
        )
