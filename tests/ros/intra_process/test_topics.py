"""Messages between co-located ports: in-process, in order, and by DDS to external nodes."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any

import pytest
from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.subscription import Subscription
from std_msgs.msg import Int64

from composer.model import LogLevel
from composer.runtime.executors.scheduler import Scheduler
from composer.runtime.host_options import HostOptions
from composer.runtime.intra_process import dds_flags
from tests.ros.support.counting import MODULE, NUMBERS, numbers, send
from tests.ros.support.in_process import Peer, RunningSystem, running, wait_until

ROLES = Path(__file__).parents[1] / "programs" / "roles.py"


def wait_for_matches(system: RunningSystem, is_matched: Callable[[int], bool]) -> None:
    """Wait until the number of matched subscriptions fits and the source knows or will check.

    The middleware counts a match before it reports it.
    """
    of_rclpy = system.publisher("source", "numbers")
    publisher = system.sender("source", "numbers")

    def is_counted() -> bool:
        matched = of_rclpy.get_subscription_count()
        has_external = matched > len(publisher._subscriptions)
        is_current = publisher._generation is dds_flags.MATCHING.generation
        will_check = not dds_flags.MATCH_FLAG[0] or not is_current
        return is_matched(matched) and (publisher._has_external is has_external or will_check)

    wait_until(is_counted, "the number of matched subscriptions")


@pytest.mark.parametrize("kind", ["events", "multi_threaded"])
def test_local_messages_are_shared_and_external_nodes_receive_them_too(
    tmp_path: Path, kind: str
) -> None:
    text = NUMBERS.replace("KIND", kind)
    with running(text, tmp_path, counting=MODULE) as system, ExitStack() as joined:
        near, far, source = (system.behavior(name) for name in ("near", "far", "source"))
        send(system, 50)
        wait_until(lambda: len(near.received) == len(far.received) == 50)
        # By reference, so DDS is not used.
        for listener in (near, far):
            assert all(a is b for a, b in zip(listener.received, source.sent, strict=True))

        # In-process delivery must work without external nodes, so it joins only now.
        peer = joined.enter_context(closing(Peer()))
        outside = peer.listen(Int64, "/numbers", 100)
        wait_for_matches(system, lambda count: count == 3)
        send(system, 50)
        wait_until(lambda: len(outside) == 50)
        wait_until(lambda: len(near.received) == len(far.received) == 100)
        assert numbers(outside) == list(range(50, 100))
        assert numbers(near.received) == numbers(far.received) == list(range(100))

        intruder = peer.publisher(Int64, "/numbers", 100)
        wait_until(lambda: intruder.get_subscription_count() == 3)  # including its own
        intruder.publish(Int64(data=-1))
        wait_until(lambda: len(near.received) == len(far.received) == 101)
        assert near.received[-1].data == far.received[-1].data == -1
        # The number of endpoints that ROS tools see.
        assert peer.node.count_publishers("/numbers") == 2
        assert peer.node.count_subscribers("/numbers") == 3


@pytest.mark.parametrize(("is_supported", "level"), [(False, "info"), (True, "debug")])
def test_every_external_subscription_is_noticed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_supported: bool, level: str
) -> None:
    if not is_supported:  # then matches are counted for each message
        monkeypatch.setattr(dds_flags.MATCHING, "is_supported", False)
    context = Context()
    context.init([])
    node = Node("external", context=context)
    apart = NUMBERS.replace("KIND", "events").replace("executors:", "namespace: /apart\nexecutors:")
    options = HostOptions(log_level=LogLevel(level))
    with running(apart, tmp_path, options=options, counting=MODULE) as system:
        publisher = system.publisher("source", "numbers")
        count = system.ros_node("source").count_subscribers
        for turn in range(5):
            send(system, 10)
            before = publisher.get_subscription_count()
            subscription = node.create_subscription(Int64, "/apart/numbers", lambda _: None, 100)
            wait_for_matches(system, lambda count, before=before: count > before)
            send(system, 10)
            first = 20 * turn + 10
            assert [take(subscription) for _ in range(10)] == list(range(first, first + 10))
            node.destroy_subscription(subscription)
            # Otherwise its end would hide the next one.
            wait_until(lambda: count("/apart/numbers") == 2)
        near = system.behavior("near")
        wait_until(lambda: numbers(near.received) == list(range(100)))
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


def test_messages_go_only_from_active_publishers_to_active_subscribers(tmp_path: Path) -> None:
    with running(NUMBERS.replace("KIND", "events"), tmp_path, counting=MODULE) as system:
        system.change("near", "deactivate")
        send(system, 3)
        near = system.node("near")
        wait_until(lambda: near.statistics.dropped == 3)
        system.change("near", "activate")
        send(system, 2)
        wait_until(lambda: len(system.behavior("near").received) == 2)
        assert numbers(system.behavior("near").received) == [3, 4]
        # A node that is cleaned up has no subscription, so no message is kept for it.
        system.change("near", "deactivate", "cleanup")
        send(system, 2)
        wait_until(lambda: len(system.behavior("far").received) == 7)
        system.change("near", "configure", "activate")
        send(system, 1)
        wait_until(lambda: len(system.behavior("near").received) == 1)
        assert numbers(system.behavior("near").received) == [7]
        assert near.statistics.dropped == 3
        far = system.behavior("far")
        wait_until(lambda: len(far.received) == 8)
        assert numbers(far.received) == list(range(8))
        system.change("source", "deactivate")
        send(system, 3)
        system.change("source", "activate")
        send(system, 1)
        wait_until(lambda: len(system.behavior("near").received) == 2)
        assert numbers(system.behavior("near").received) == [7, 11]
        assert system.node("source").statistics.sent == 9


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


def test_late_joiners_get_latched_messages_once_in_process_and_by_dds(tmp_path: Path) -> None:
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
        with closing(Peer()) as peer:
            outside = peer.listen(Int64, "/mode", profile)
            wait_until(lambda: len(outside) == 2)
            assert numbers(outside) == [2, 3]
    assert system.log() == ["late 2", "late 3"]


def test_dds_is_used_only_while_an_external_subscription_matches(tmp_path: Path) -> None:
    """The middleware numbers its messages: in-process messages have no number."""
    with running(NUMBERS.replace("KIND", "events"), tmp_path, counting=MODULE) as system:
        for visit in range(2):
            send(system, 20)  # to no external node
            command = [sys.executable, str(ROLES), "numbering"]
            with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as listener:
                try:
                    wait_for_matches(system, lambda count: count == 3)
                    send(system, 5)
                    printed, _ = listener.communicate(timeout=60.0)
                finally:
                    listener.kill()
            first = visit * 25 + 20
            # Fast DDS prints its errors there too.
            (line,) = [line for line in printed.splitlines() if line.startswith("[[")]
            assert json.loads(line) == [[first + step, visit * 5 + step + 1] for step in range(5)]
            wait_for_matches(system, lambda count: count == 2)
        wait_until(lambda: len(system.behavior("near").received) == 50)
        assert numbers(system.behavior("near").received) == list(range(50))


def test_the_generation_changes_before_and_after_the_flag_is_set(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Once the flag is set, no thread may see the old generation."""
    matching = dds_flags.Matching()
    generations = [matching.generation]

    class Flag(bytearray):
        def __setitem__(self, *_: Any) -> None:
            generations.append(matching.generation)

    monkeypatch.setattr(dds_flags, "MATCH_FLAG", Flag(1))
    matching.begin_generation()
    assert len({*generations, matching.generation}) == 3


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


def test_ports_connect_by_their_remapped_names(tmp_path: Path, peer: Peer) -> None:
    with running(REMAPPED, tmp_path, counting=MODULE) as system:
        source, near, far = (system.behavior(name) for name in ("source", "near", "far"))
        intruder = peer.publisher(Int64, "/left/numbers")
        outside = peer.listen(Int64, "/lane/numbers")
        wait_for_matches(system, lambda count: count == 2)
        send(system, 3)
        intruder.publish(Int64(data=-1))  # the topic of far, which has no other messages
        wait_until(lambda: len(near.received) == len(outside) == 3)
        wait_until(lambda: far.received)
        assert all(a is b for a, b in zip(near.received, source.sent, strict=True))
        assert numbers(outside) == [0, 1, 2]
        assert numbers(far.received) == [-1]


@pytest.mark.parametrize(
    ("history", "sent", "kept"),
    [("depth: 1", 1000, 1), ("depth: 500", 1000, 500), ("history: keep_all", 5000, 5000)],
)
def test_a_flood_keeps_messages_within_the_depth_and_counts_the_rest(
    tmp_path: Path, history: str, sent: int, kept: int
) -> None:
    text = NUMBERS.replace("KIND", "events").replace("depth: 100", history)
    with running(text, tmp_path, counting=MODULE) as system:
        send(system, sent)
        near = system.behavior("near")
        wait_until(lambda: len(near.received) == kept)
        assert numbers(near.received) == list(range(sent - kept, sent))
        assert system.node("near").statistics.dropped == sent - kept


@pytest.mark.parametrize("kind", ["events", "multi_threaded"])
@pytest.mark.parametrize("depth", [1, 500])
def test_concurrent_publishers_lose_no_message_uncounted(
    tmp_path: Path, kind: str, depth: int
) -> None:
    text = NUMBERS.replace("KIND", kind).replace("100", str(depth))
    with running(text, tmp_path, counting=MODULE) as system:
        far, publish = system.node("far"), system.behavior("source").publishers.numbers

        def write(first: int) -> None:
            for number in range(first, first + 5000):
                publish.publish(Int64(data=number))

        writers = [threading.Thread(target=write, args=(k * 5000,)) for k in range(4)]
        for writer in writers:
            writer.start()
        for writer in writers:
            writer.join()
        wait_until(lambda: len(system.behavior("far").received) + far.statistics.dropped == 20_000)
        received = numbers(system.behavior("far").received)
        for k in range(4):
            from_one = [number for number in received if number // 5000 == k]
            assert from_one == sorted(from_one)
        assert {number % 5000 for number in received} & {4999}  # the last one arrives


@pytest.mark.parametrize("kind", ["events", "multi_threaded"])
def test_a_flood_neither_fills_the_loop_nor_delays_later_messages(
    tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    call_soon, loops = Scheduler.call_soon, list[Scheduler]()

    def counted(loop: Scheduler, callback: Callable[[], object]) -> None:
        loops.append(loop)
        call_soon(loop, callback)

    monkeypatch.setattr(Scheduler, "call_soon", counted)
    with running(NUMBERS.replace("KIND", kind), tmp_path, counting=MODULE) as system:
        far, release = system.node("far"), threading.Event()
        for _ in range(8):  # one per possible thread
            far.loop.call_soon(release.wait)
        before = loops.count(far.loop)
        for _ in range(20):
            send(system, 500)  # from the thread of another loop
        assert loops.count(far.loop) - before < 120  # its depth, and few other calls
        release.set()
        wait_until(lambda: len(system.behavior("far").received) + far.statistics.dropped == 10_000)
        assert numbers(system.behavior("far").received)[-100:] == list(range(9_900, 10_000))
        for number in range(10_000, 10_003):
            send(system, 1)
            wait_until(lambda n=number: numbers(system.behavior("far").received)[-1] == n)
