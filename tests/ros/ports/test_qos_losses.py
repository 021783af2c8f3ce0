"""Messages that are lost in transit, and publishers that fall silent: logged and counted.

The flooding process is killed after the system has ended: if a writer is killed in the middle of a
large message, Fast DDS recreates a shared memory port, and crashes if that is closed meanwhile.
"""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import pytest
from rclpy.duration import Duration
from rclpy.event_handler import QoSSubscriptionEventType
from rclpy.qos import QoSProfile
from std_msgs.msg import String

from composer.runtime.executors.loop import Loop
from composer.runtime.executors.sources import EventCounts
from tests.ros.support.commands import hand_written
from tests.ros.support.in_process import PATIENCE_S, Peer, RunningSystem, running, wait_until


def counts(system: RunningSystem) -> dict[str, int]:
    return dict(system.node("listener").statistics.qos_events)


LOSSES = """
system: losses
nodes:
  listener:
    behavior: numbers:Numbers
    subscriptions:
      big: {type: sensor_msgs/msg/Image, qos: sensor_data, external: true}
      alive: {type: std_msgs/msg/String, external: true}
"""
NUMBERS = """
    from composer.behavior import Behavior

    class Numbers(Behavior):
        def on_configure(self):
            self.seen = []

        def on_big(self, message):
            self.seen.append(message.width)
"""


def test_messages_that_are_lost_are_counted_one_by_one(tmp_path: Path) -> None:
    with (
        hand_written("hand_written_flood.py"),
        running(LOSSES, tmp_path, numbers=NUMBERS) as system,
    ):
        seen: list[int] = system.behavior("listener").seen
        wait_until(lambda: seen)
        losses: defaultdict[int, set[int]] = defaultdict(set)

        def three_floods_add_up() -> bool:
            """The messages that were sent but neither received nor lost are constant when idle."""
            lost, numbers = counts(system).get("message_lost", 0), tuple(seen)
            losses[numbers[-1] - len(numbers) - lost].add(lost)
            return any(len(found) > 2 for found in losses.values())

        wait_until(three_floods_add_up)
        line = system.wait_for_log("lost")
        assert line.startswith("subscription 'big' on /big: a message was lost in transit; it is ")


SILENCE = """
system: silence
qos_profiles: {alive: {extends: command, liveliness_lease_duration_ms: 3000}}
nodes:
  listener:
    subscriptions:
      alive: {type: std_msgs/msg/String, qos: alive, external: true, log: "got a message"}
"""


def test_a_silent_publisher_is_logged_and_one_that_leaves_is_not(
    tmp_path: Path, peer: Peer
) -> None:
    with running(SILENCE, tmp_path) as system:
        qos = QoSProfile(depth=10, liveliness_lease_duration=Duration(nanoseconds=3_000_000_000))
        leaving = peer.publisher(String, "/alive", qos)
        with hand_written("hand_written_flood.py", "3000", "0") as flood:
            system.wait_for_log("got a message")
            node = system.ros_node("listener")
            wait_until(lambda: "flood" in node.get_node_names(), "its name")
            before = counts(system)
            peer.node.destroy_publisher(leaving)
            wait_until(lambda: node.count_publishers("/alive") == 1, "the end of the other one")
            assert counts(system) == before
            flood.kill()
            assert system.wait_for_log("did not assert its liveliness") == (
                "subscription 'alive' on /alive: a publisher did not assert its liveliness "
                "within the lease of 3000 ms; it is published by /flood"
            )
        assert counts(system)["liveliness_changed"] == before.get("liveliness_changed", 0) + 1


RESTLESS = """
system: restless
qos_profiles:
  restless: {extends: command, liveliness: manual_by_topic, liveliness_lease_duration_ms: 10}
nodes:
  listener:
    subscriptions:
      big: {type: sensor_msgs/msg/Image, qos: sensor_data, external: true}
      alive: {type: std_msgs/msg/String, qos: restless, external: true}
    timers: {tick: {period_ms: 20, log: "tick"}}
"""


def test_constant_events_are_watched_from_the_start_and_do_not_deadlock(tmp_path: Path) -> None:
    with (
        hand_written("hand_written_flood.py", "10", "100"),
        hand_written("hand_written_flood.py", "10", "100"),
        running(RESTLESS, tmp_path) as system,
    ):
        # Starting to watch takes a status, too. rclpy's handlers were watched once their node's
        # loop had found them, when messages could be lost: one in hundreds of runs deadlocked.
        subscriptions = list(system.ros_node("listener").subscriptions)
        assert [ends.topic_name for ends in subscriptions] == ["/big", "/alive"]
        assert [ends.event_handlers for ends in subscriptions] == [[], []]
        wait_until(lambda: counts(system).get("liveliness_changed", 0) > 100)
        ticks = system.log().count("tick")
        wait_until(lambda: system.log().count("tick") > ticks + 20)
        wait_until(lambda: counts(system).get("message_lost"))
        system.change("listener", "deactivate", "cleanup", "configure", "activate")
        before = counts(system)["liveliness_changed"]
        wait_until(lambda: counts(system)["liveliness_changed"] > before + 20)


def test_constantly_taken_statuses_do_not_deadlock(peer: Peer) -> None:
    # Taking a status that is not available waits for the thread that reports the next, which
    # waits too: it deadlocked within two seconds.
    loop = Loop("loop", lambda _, error: pytest.fail(repr(error)))
    loop.start()
    qos = QoSProfile(depth=10, deadline=Duration(nanoseconds=1_000_000))
    subscription = peer.node.create_subscription(String, "/late", lambda _: None, qos)
    publisher = peer.publisher(String, "/late", qos)
    publisher.publish(String())
    counts_seen: list[int] = []
    kind = QoSSubscriptionEventType.RCL_SUBSCRIPTION_REQUESTED_DEADLINE_MISSED
    end = EventCounts(loop).watch_status(
        subscription.handle, kind, lambda status: counts_seen.append(status.total_count)
    )
    try:
        wait_until(lambda: counts_seen and counts_seen[-1] > counts_seen[0] + 3000)
        seen = list(counts_seen)  # the loop goes on
        assert seen == sorted(set(seen))
    finally:
        end()
        assert loop.stop(PATIENCE_S)
