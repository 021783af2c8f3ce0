"""Missed deadlines and lost liveliness: logged at once, summarized and counted."""

from __future__ import annotations

import re
import time
from pathlib import Path

import pytest
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import String

from composer.runtime.ports import qos_events
from tests.ros.support.in_process import Peer, RunningSystem, running, wait_until

KINDS = ["events", "multi_threaded"]


def counts(system: RunningSystem, node: str) -> dict[str, int]:
    return dict(system.node(node).statistics.qos_events)


def lines(system: RunningSystem, part: str) -> list[str]:
    return [line for line in system.log() if part in line]


def publishers(node: Node, topic: str) -> list[str]:
    """Return the names of the publishers that a node has discovered."""
    return [end.node_name for end in node.get_publishers_info_by_topic(topic)]


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
        node = system.ros_node("listener")
        wait_until(lambda: publishers(node, "/beat") == [peer.node.get_name()], "its name")
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
