"""Messages between co-located ports: straight, in order, and by DDS to whoever is outside."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.subscription import Subscription
from std_msgs.msg import Int64

from composer.model import LogLevel
from composer.runtime import marks
from composer.runtime.host import HostOptions
from tests.ros.system_bench import Peer, RunningSystem, running, wait_until

NUMBERING_LISTENER = Path(__file__).with_name("numbering_listener.py")


@pytest.fixture
def outsider() -> Iterator[Callable[[], Peer]]:
    """Joins when it is called: what goes in the process is to go without anybody outside."""
    peers: list[Peer] = []

    def join() -> Peer:
        peers.append(Peer())
        return peers[-1]

    yield join
    for peer in peers:
        peer.close()


NUMBERS = """
system: numbers
executors: {other: {kind: KIND}}
nodes:
  source:
    behavior: counting:Source
    publishers:
      numbers: {type: std_msgs/msg/Int64, qos: {depth: 100}}
  near:
    behavior: counting:Listener
    subscriptions:
      numbers: {type: std_msgs/msg/Int64, qos: {depth: 100}}
  far:
    executor: other
    behavior: counting:Listener
    subscriptions:
      numbers: {type: std_msgs/msg/Int64, qos: {depth: 100}}
"""
MODULE = """
from composer.behavior import Behavior
from std_msgs.msg import Int64

class Source(Behavior):
    def on_configure(self):
        self.next = 0
        self.sent = []

    def send(self, count):
        for _ in range(count):
            self.sent.append(Int64(data=self.next))
            self.publishers.numbers.publish(self.sent[-1])
            self.next += 1

class Listener(Behavior):
    def on_configure(self):
        self.heard = []

    def on_numbers(self, message):
        self.heard.append(message)
"""


def behavior(system: RunningSystem, node: str) -> Any:
    return system.host._crew.nodes[node]._behavior


def send(system: RunningSystem, count: int) -> None:
    """Have the source publish so many at once, in a callback of its loop."""
    source = system.host._crew.nodes["source"]
    source.loop.run(lambda: source._behavior.send(count))


def wait_for_matches(system: RunningSystem, is_matched: Callable[[int], bool]) -> None:
    """Wait until as many subscriptions as that have matched the source, and it was told to look.

    The middleware counts first, and tells then.
    """
    port = system.host._crew.nodes["source"]._assembly.publishers["numbers"]
    outlet = port.sender

    def knows() -> bool:
        matched = port._publisher.get_subscription_count()
        has_outsiders = matched > len(outlet._inlets)
        will_look = not marks.MARK[0] or outlet._period is not marks.MATCHES.period
        return is_matched(matched) and (outlet._has_outsiders is has_outsiders or will_look)

    wait_until(knows, "so many subscriptions")


def numbers(messages: list[Any]) -> list[int]:
    return [message.data for message in messages]


@pytest.mark.parametrize("kind", ["events", "single_threaded", "multi_threaded"])
def test_what_is_published_is_what_is_received_and_outsiders_hear_it_too(
    tmp_path: Path, outsider: Callable[[], Peer], kind: str
) -> None:
    with running(NUMBERS.replace("KIND", kind), tmp_path, counting=MODULE) as system:
        near, far, source = (behavior(system, name) for name in ("near", "far", "source"))
        send(system, 50)
        wait_until(lambda: len(near.heard) == len(far.heard) == 50)
        # By reference: nothing of it went through DDS.
        for listener in (near, far):
            assert all(a is b for a, b in zip(listener.heard, source.sent, strict=True))

        peer = outsider()
        outside = peer.listen(Int64, "/numbers", 100)
        wait_for_matches(system, lambda count: count == 3)
        send(system, 50)
        wait_until(lambda: len(outside) == 50)
        wait_until(lambda: len(near.heard) == len(far.heard) == 100)
        assert numbers(outside) == list(range(50, 100))
        assert numbers(near.heard) == numbers(far.heard) == list(range(100))

        intruder = peer.publisher(Int64, "/numbers", 100)
        wait_until(lambda: intruder.get_subscription_count() == 3)  # its own is one of them
        intruder.publish(Int64(data=-1))
        wait_until(lambda: len(near.heard) == len(far.heard) == 101)
        assert near.heard[-1].data == far.heard[-1].data == -1
        # As many ends as ROS tools are to see.
        assert peer.node.count_publishers("/numbers") == 2
        assert peer.node.count_subscribers("/numbers") == 3


@pytest.mark.parametrize(("tells", "level"), [(False, "info"), (True, "info"), (True, "debug")])
def test_every_outsider_is_seen_to_come(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, tells: bool, level: str
) -> None:
    if not tells:  # then the middleware is asked at each message
        monkeypatch.setattr(marks, "EVENT", lambda *_: 1)
    context = Context()
    context.init([])
    node = Node("outsider", context=context)
    apart = NUMBERS.replace("KIND", "events").replace("executors:", "namespace: /apart\nexecutors:")
    options = HostOptions(log_level=LogLevel(level))
    with running(apart, tmp_path, options=options, counting=MODULE) as system:
        source = system.host._crew.nodes["source"]
        publisher = source._assembly.publishers["numbers"]._publisher
        for turn in range(5):
            send(system, 10)
            before = publisher.get_subscription_count()
            subscription = node.create_subscription(Int64, "/apart/numbers", lambda _: None, 100)
            wait_for_matches(system, lambda count, before=before: count > before)
            send(system, 10)
            first = 20 * turn + 10
            assert [take(subscription) for _ in range(10)] == list(range(first, first + 10))
            node.destroy_subscription(subscription)
            # Or its end would hide that the next one begins.
            wait_until(lambda: source._core.node.count_subscribers("/apart/numbers") == 2)
        near = behavior(system, "near")
        wait_until(lambda: numbers(near.heard) == list(range(100)))
    node.destroy_node()
    context.try_shutdown()


def take(subscription: Subscription) -> int:
    """Wait for the next message. No executor: its wait set would keep the subscription alive."""
    taken: list[Any] = []

    def comes() -> bool:
        with subscription.handle:
            message = subscription.handle.take_message(Int64, False)
        taken.extend([] if message is None else [message[0]])
        return bool(taken)

    wait_until(comes)
    return int(taken[0].data)


def test_what_is_under_way_when_its_reader_leaves_active_is_dropped(tmp_path: Path) -> None:
    with running(NUMBERS.replace("KIND", "events"), tmp_path, counting=MODULE) as system:
        system.change("near", "deactivate")
        send(system, 3)
        near = system.host._crew.nodes["near"]
        wait_until(lambda: near.statistics.dropped == 3)
        system.change("near", "activate")
        send(system, 2)
        wait_until(lambda: len(near._behavior.heard) == 2)
        assert numbers(near._behavior.heard) == [3, 4]
        # A node that is cleaned up has no subscription: nothing is kept for it.
        system.change("near", "deactivate", "cleanup")
        send(system, 2)
        wait_until(lambda: len(behavior(system, "far").heard) == 7)
        system.change("near", "configure", "activate")
        send(system, 1)
        wait_until(lambda: len(near._behavior.heard) == 1)
        assert numbers(near._behavior.heard) == [7]
        assert near.statistics.dropped == 3
        far = behavior(system, "far")
        wait_until(lambda: len(far.heard) == 8)
        assert numbers(far.heard) == list(range(8))


@pytest.mark.parametrize("depth", [1, 100, 500])
def test_a_flood_leaves_what_the_depth_allows_and_the_rest_is_counted(
    tmp_path: Path, depth: int
) -> None:
    text = NUMBERS.replace("KIND", "events").replace("100", str(depth))
    with running(text, tmp_path, counting=MODULE) as system:
        send(system, 1000)
        near = system.host._crew.nodes["near"]
        wait_until(lambda: len(near._behavior.heard) == depth)
        assert numbers(near._behavior.heard) == list(range(1000 - depth, 1000))
        assert near.statistics.dropped == 1000 - depth


def test_without_a_depth_nothing_of_a_flood_is_dropped(tmp_path: Path) -> None:
    text = NUMBERS.replace("KIND", "events").replace("depth: 100", "history: keep_all")
    with running(text, tmp_path, counting=MODULE) as system:
        send(system, 5000)
        near = system.host._crew.nodes["near"]
        wait_until(lambda: len(near._behavior.heard) == 5000)
        assert numbers(near._behavior.heard) == list(range(5000))
        assert near.statistics.dropped == 0


@pytest.mark.parametrize("kind", ["events", "multi_threaded"])
@pytest.mark.parametrize("depth", [1, 3, 500])
def test_threads_that_push_each_other_out_lose_nothing_that_is_not_counted(
    tmp_path: Path, kind: str, depth: int
) -> None:
    text = NUMBERS.replace("KIND", kind).replace("100", str(depth))
    with running(text, tmp_path, counting=MODULE) as system:
        far, publish = system.host._crew.nodes["far"], behavior(system, "source").publishers.numbers

        def write(first: int) -> None:
            for number in range(first, first + 5000):
                publish.publish(Int64(data=number))

        writers = [threading.Thread(target=write, args=(k * 5000,)) for k in range(4)]
        for writer in writers:
            writer.start()
        for writer in writers:
            writer.join()
        wait_until(lambda: len(far._behavior.heard) + far.statistics.dropped == 20_000)
        heard = numbers(far._behavior.heard)
        for k in range(4):
            from_one = [number for number in heard if number // 5000 == k]
            assert from_one == sorted(from_one)
        assert {number % 5000 for number in heard} & {4999}  # the very last comes


@pytest.mark.parametrize("kind", ["events", "single_threaded", "multi_threaded"])
def test_a_flood_fills_no_loop_and_delays_nothing_that_comes_after(
    tmp_path: Path, kind: str
) -> None:
    with running(NUMBERS.replace("KIND", kind), tmp_path, counting=MODULE) as system:
        far, release = system.host._crew.nodes["far"], threading.Event()
        for _ in range(8):  # as many as it can have threads
            far.loop.call_soon(release.wait)
        for _ in range(20):
            send(system, 500)  # from the thread of another loop
        assert len(far.loop._calls) < 120  # its depth, and little else
        release.set()
        wait_until(lambda: len(far._behavior.heard) + far.statistics.dropped == 10_000)
        assert numbers(far._behavior.heard)[-100:] == list(range(9_900, 10_000))
        for number in range(10_000, 10_003):
            send(system, 1)
            wait_until(lambda n=number: numbers(far._behavior.heard)[-1] == n)


LATCHED = """
system: latched
nodes:
  setter:
    publishers: {mode: {type: std_msgs/msg/Int64, qos: {extends: state, depth: 2}}}
    behavior: setter:Setter
  late:
    lifecycle: {autostart: unconfigured}
    subscriptions:
      mode: {type: std_msgs/msg/Int64, qos: {extends: state, depth: 5}, log: "late {message.data}"}
  volatile:
    lifecycle: {autostart: unconfigured}
    subscriptions:
      mode: {type: std_msgs/msg/Int64, log: "volatile {message.data}"}
"""


def test_who_joins_late_gets_what_is_latched_once_inside_and_outside(
    tmp_path: Path, outsider: Callable[[], Peer]
) -> None:
    module = """
    from composer.behavior import Behavior
    from std_msgs.msg import Int64

    class Setter(Behavior):
        def on_activate(self):
            for number in (1, 2, 3):
                self.publishers.mode.publish(Int64(data=number))
    """
    with running(LATCHED, tmp_path, setter=module) as system:
        for node in ("volatile", "late"):
            system.change(node, "configure", "activate")
        system.wait_for_log("late 3")
        profile = QoSProfile(depth=2, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        outside = outsider().listen(Int64, "/mode", profile)
        wait_until(lambda: len(outside) == 2)
        assert numbers(outside) == [2, 3]
    assert system.log() == ["late 2", "late 3"]


def test_dds_is_used_only_while_somebody_outside_has_matched(tmp_path: Path) -> None:
    """The middleware numbers what a publisher hands it: what stays inside has no number."""
    with running(NUMBERS.replace("KIND", "events"), tmp_path, counting=MODULE) as system:
        for visit in range(2):
            send(system, 20)  # to nobody outside
            command = [sys.executable, str(NUMBERING_LISTENER)]
            with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as listener:
                try:
                    wait_for_matches(system, lambda count: count == 3)
                    send(system, 5)
                    printed, _ = listener.communicate(timeout=20.0)
                finally:
                    listener.kill()
            first = visit * 25 + 20
            # Fast DDS prints there, too, when something is not to its liking.
            (told,) = [line for line in printed.splitlines() if line.startswith("[[")]
            assert json.loads(told) == [[first + step, visit * 5 + step + 1] for step in range(5)]
            wait_for_matches(system, lambda count: count == 2)
        wait_until(lambda: len(behavior(system, "near").heard) == 50)
        assert numbers(behavior(system, "near").heard) == list(range(50))


def test_a_publisher_that_is_not_active_reaches_nobody_inside(tmp_path: Path) -> None:
    with running(NUMBERS.replace("KIND", "events"), tmp_path, counting=MODULE) as system:
        send(system, 2)
        system.change("source", "deactivate")
        send(system, 3)
        system.change("source", "activate")
        send(system, 1)
        near = behavior(system, "near")
        wait_until(lambda: 5 in numbers(near.heard))
        assert numbers(near.heard) == [0, 1, 5]
        assert system.host._crew.nodes["source"].statistics.sent == 3


def test_a_look_that_is_overtaken_does_not_hide_who_has_come(tmp_path: Path) -> None:
    """Two threads publish when somebody matches: the one looks before that, the other after it."""
    with running(NUMBERS.replace("KIND", "events"), tmp_path, counting=MODULE) as system:
        port = system.host._crew.nodes["source"]._assembly.publishers["numbers"]
        outlet = port.sender
        overtaking = threading.Thread(target=outlet._look_outside)

        def count_matched() -> int:
            if threading.current_thread() is overtaking:
                return 3
            overtaking.start()
            overtaking.join(0.2)  # unless it has to wait
            return 2

        outlet._count_matched = count_matched
        outlet._look_outside()
        overtaking.join()
        assert outlet._has_outsiders


REMAPPED = """
system: remapped
nodes:
  source:
    namespace: left
    behavior: counting:Source
    remappings: {numbers: /lane/numbers}
    publishers: {numbers: {type: std_msgs/msg/Int64}}
  near:
    namespace: right
    behavior: counting:Listener
    remappings: {/right/numbers: /lane/numbers}
    subscriptions: {numbers: {type: std_msgs/msg/Int64}}
  far:
    namespace: left
    behavior: counting:Listener
    subscriptions: {numbers: {type: std_msgs/msg/Int64, external: true}}
"""


def test_ports_meet_by_the_names_that_remapping_gives_them(tmp_path: Path, peer: Peer) -> None:
    with running(REMAPPED, tmp_path, counting=MODULE) as system:
        source, near, far = (behavior(system, name) for name in ("source", "near", "far"))
        intruder = peer.publisher(Int64, "/left/numbers")
        outside = peer.listen(Int64, "/lane/numbers")
        wait_for_matches(system, lambda count: count == 2)
        send(system, 3)
        intruder.publish(Int64(data=-1))  # where far is left: nothing else is said there
        wait_until(lambda: len(near.heard) == len(outside) == 3)
        wait_until(lambda: far.heard)
        assert all(a is b for a, b in zip(near.heard, source.sent, strict=True))
        assert numbers(outside) == [0, 1, 2]
        assert numbers(far.heard) == [-1]
