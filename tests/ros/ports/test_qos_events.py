"""QoS events of all kinds: logged with the names of nodes, summarized and counted."""

from __future__ import annotations

import json
import re
import time
from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Int64, String

from composer.runtime.ports import qos_events
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
qos_profiles:
  brief: {extends: state, lifespan_ms: 300}
  long: {extends: state, lifespan_ms: 60000}
nodes:
  talker:
    publishers:
      brief: {type: std_msgs/msg/String, qos: brief}
      long: {type: std_msgs/msg/String, qos: long}
    subscriptions:
      say: {type: std_msgs/msg/String, external: true, log: "said {message.data}",
            publish: {brief: {data: "{message.data}"}, long: {data: "{message.data}"}}}
  listener:
    subscriptions:
      brief: {type: std_msgs/msg/String, qos: brief, log: "brief {message.data}"}
      long: {type: std_msgs/msg/String, qos: long, log: "long {message.data}"}
"""


@pytest.mark.parametrize("away", [("deactivate", "cleanup"), ("deactivate",)])
def test_a_lifespan_applies_within_the_process(
    tmp_path: Path, peer: Peer, away: tuple[str, ...]
) -> None:
    with running(LATCHED, tmp_path) as system:
        say = peer.publisher(String, "/say")
        system.change("listener", *away)
        say.publish(String(data="old"))
        system.wait_for_log("said old")
        over_s = time.monotonic() + 1.0
        wait_until(lambda: time.monotonic() > over_s, "the end of the lifespan")
        back = ("configure", "activate") if "cleanup" in away else ("activate",)
        system.change("listener", *back)
        system.wait_for_log("long old")

        def is_new_received() -> bool:
            """Publish until it arrives: on a busy machine the lifespan may end in transit."""
            say.publish(String(data="new"))
            return {"brief new", "long new"} <= set(system.log())

        wait_until(is_new_received)
        assert [*dict.fromkeys(lines(system, "brief"))] == ["brief new"]
        assert [*dict.fromkeys(lines(system, "long"))] == ["long old", "long new"]


def is_logged(system: RunningSystem, pattern: str) -> bool:
    return any(re.fullmatch(pattern, line) for line in system.log())


TIMED = """
system: timed
executors: {{default: {{kind: {kind}}}}}
qos_profiles: {{beat: {{extends: command, deadline_ms: {deadline_ms}}}}}
nodes:
  talker:
    parameters: {{period_ms: 20.0}}
    publishers: {{beat: {{type: std_msgs/msg/String, qos: beat}}}}
    timers: {{tick: {{period_ms: "{{parameters.period_ms}}", publish: {{beat: {{data: x}}}}}}}}
  listener:
    subscriptions: {{beat: {{type: std_msgs/msg/String, qos: beat, log: "got a message"}}}}
"""
OF_PUBLISHER = "publisher 'beat' on /beat: nothing was published within its deadline of 200 ms"
OF_SUBSCRIPTION = "subscription 'beat' on /beat: nothing was received within its deadline of 200 ms"


@pytest.mark.parametrize("kind", KINDS)
def test_a_missed_deadline_is_logged_at_once_and_then_summarized(
    tmp_path: Path, peer: Peer, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(qos_events, "WARNING_PERIOD_S", 1.0)
    with running(TIMED.format(kind=kind, deadline_ms=200), tmp_path) as system:
        wait_until(lambda: len(lines(system, "got a message")) > 10)
        assert peer.set_parameter("/talker", "period_ms", 1e6) == ""
        # On a busy machine the talker may have missed one before, which is logged separately.
        more = r" \(\d+ more since the last message\)"
        of_talker = "; it is published by /talker"
        wait_until(lambda: is_logged(system, re.escape(OF_PUBLISHER) + more))
        wait_until(lambda: is_logged(system, re.escape(OF_SUBSCRIPTION + of_talker) + more))
        assert lines(system, OF_PUBLISHER)[0] == OF_PUBLISHER
        assert lines(system, OF_SUBSCRIPTION)[0] == OF_SUBSCRIPTION + of_talker
        for node in ("talker", "listener"):
            wait_until(lambda node=node: counts(system, node)["deadline_missed"] > 2)


@pytest.mark.parametrize("kind", KINDS)
def test_constantly_missed_deadlines_do_not_deadlock(tmp_path: Path, peer: Peer, kind: str) -> None:
    # Taking the status of each froze the process within two seconds.
    with running(TIMED.format(kind=kind, deadline_ms=2), tmp_path) as system:
        wait_until(lambda: counts(system, "listener").get("deadline_missed", 0) > 1000)
        received = len(lines(system, "got a message"))
        wait_until(lambda: len(lines(system, "got a message")) > received + 10)
        system.change("listener", "deactivate", "cleanup", "configure", "activate")
        before = counts(system, "listener")["deadline_missed"]
        wait_until(lambda: counts(system, "listener")["deadline_missed"] > before + 100)


def test_an_inactive_publisher_misses_no_deadline(tmp_path: Path, peer: Peer) -> None:
    with running(TIMED.format(kind="events", deadline_ms=200), tmp_path) as system:
        wait_until(lambda: len(lines(system, "got a message")) > 10)
        assert peer.change("/talker", "deactivate")

        def wait_for_misses(count: int) -> None:
            missed = counts(system, "listener").get("deadline_missed", 0)
            wait_until(lambda: counts(system, "listener")["deadline_missed"] >= missed + count)

        # On a busy machine the talker may have missed one before, which is counted later.
        wait_until(lambda: counts(system, "listener").get("deadline_missed", 0))
        wait_for_misses(1)
        before = counts(system, "talker")
        wait_for_misses(3)
        assert counts(system, "talker") == before  # an inactive node must be silent


def test_the_time_before_an_activation_does_not_count(tmp_path: Path, peer: Peer) -> None:
    with running(TIMED.format(kind="events", deadline_ms=600), tmp_path) as system:
        assert peer.set_parameter("/talker", "period_ms", 350.0) == ""
        wait_until(lambda: lines(system, "got a message"))
        is_in_time = False
        while not is_in_time:  # again if a busy machine itself has needed the rest of the deadline
            assert peer.change("/talker", "deactivate")
            over_s = time.monotonic() + 0.4
            wait_until(lambda: time.monotonic() > over_s, "most of the deadline")  # noqa: B023
            before, received = counts(system, "talker"), len(lines(system, "got a message"))
            began_s = time.monotonic()
            assert peer.change("/talker", "activate")
            wait_until(lambda: len(lines(system, "got a message")) > received)  # noqa: B023
            after = counts(system, "talker")
            is_in_time = time.monotonic() - began_s < 0.55
        assert after == before


def test_a_kept_deadline_is_not_reported(tmp_path: Path) -> None:
    with running(TIMED.format(kind="events", deadline_ms=60_000), tmp_path) as system:
        over_s = time.monotonic() + 1.0
        wait_until(lambda: time.monotonic() > over_s, "a second of beats")
        wait_until(lambda: lines(system, "got a message"))
        assert counts(system, "talker") == counts(system, "listener") == {}


OUTSIDE = """
system: outside
qos_profiles:
  beat: {extends: command, deadline_ms: 200}
  alive: {extends: command, liveliness: manual_by_topic, liveliness_lease_duration_ms: 300}
nodes:
  listener:
    subscriptions:
      beat: {type: std_msgs/msg/String, qos: beat, external: true, log: "got a message"}
  talker:
    publishers: {alive: {type: std_msgs/msg/String, qos: alive, external: true}}
    subscriptions:
      go: {type: std_msgs/msg/String, external: true, publish: {alive: {data: x}}}
"""


def test_external_nodes_are_named_and_a_publisher_without_liveliness_is_logged(
    tmp_path: Path, peer: Peer
) -> None:
    with running(OUTSIDE, tmp_path) as system:
        qos = QoSProfile(depth=10, deadline=Duration(nanoseconds=200_000_000))
        publisher = peer.publisher(String, "/beat", qos)
        own = [peer.node.get_name()]
        wait_until(lambda: publishers(system, "listener", "/beat") == own, "its name")
        publisher.publish(String())
        system.wait_for_log("got a message")
        name = peer.node.get_fully_qualified_name()
        assert name in system.wait_for_log(OF_SUBSCRIPTION)
        peer.publisher(String, "/go").publish(String())
        assert system.wait_for_log("did not assert its liveliness") == (
            "publisher 'alive' on /alive: "
            "it did not assert its liveliness within its lease of 300 ms"
        )
        assert counts(system, "talker") == {"liveliness_lost": 1}
