"""External nodes join, leave and die; in-process nothing is lost, duplicated or reordered.

Everything is published twice, on a topic that stays in the process as far as it can, and on another
by DDS alone. The same processes listen to both and talk on both, so that one is the control of the
other: outside as well, no message that is owed may be missing unless DDS loses some.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.ros.support.external_processes import (
    STREAM,
    TOPICS,
    ExternalProcess,
    Missing,
    sequences_of,
)
from tests.ros.support.in_process import RunningSystem, running, wait_until
from tests.ros.support.sequences import Sequences

WRITERS = ("writer", "second")
#: Reliability and depth of those outside, by turns. The first are owed every message.
OWED, *_ = PROFILES = (
    ("RELIABLE", 5000),
    ("BEST_EFFORT", 5000),
    ("RELIABLE", 10),
    ("BEST_EFFORT", 10),
)
ENOUGH = 1000  # messages of each topic that a listener receives before it leaves
FIRST_TALKER = 100
MOVES = 3  # of an in-process reader, while each listener listens

TEXT = """
system: stress
executors: {other: {}, pool: {kind: multi_threaded, threads: 2}}
qos_profiles:
  deep: {depth: 5000}
  unreliable: {depth: 5000, reliability: best_effort}
nodes:
  writer:
    behavior: stress:Writer
    publishers:
      stream: {type: std_msgs/msg/Int64, qos: deep}
      control: {type: std_msgs/msg/Int64, qos: deep}
    timers: {tick: {rate_hz: 1000}, burst: {period_ms: 200}}
  second:
    behavior: stress:Writer
    executor: other
    publishers:
      stream: {type: std_msgs/msg/Int64, qos: deep}
      control: {type: std_msgs/msg/Int64, qos: deep}
      calm: {type: std_msgs/msg/Int64, qos: deep}
    timers: {tick: {rate_hz: 100}, burst: {period_ms: 500}}
  near:
    behavior: stress:Reader
    subscriptions:
      stream: {type: std_msgs/msg/Int64, qos: deep}
      control: {type: std_msgs/msg/Int64, qos: deep}
  far:
    behavior: stress:Reader
    executor: other
    subscriptions:
      stream: {type: std_msgs/msg/Int64, qos: unreliable}
      control: {type: std_msgs/msg/Int64, qos: unreliable}
  guest:
    behavior: stress:Reader
    subscriptions:
      stream: {type: std_msgs/msg/Int64, qos: deep}
      control: {type: std_msgs/msg/Int64, qos: deep}
  pooled:
    behavior: stress:Reader
    executor: pool
    subscriptions: {calm: {type: std_msgs/msg/Int64, qos: deep}}
connections:
  - topic: /stream
    from: [writer.stream, second.stream]
    to: [near.stream, far.stream, guest.stream]
  - topic: /control
    from: [writer.control, second.control]
    to: [near.control, far.control, guest.control]
    delivery: dds
  - {topic: /calm, from: second.calm, to: pooled.calm}
"""
MODULE = """
import itertools
import threading
import time

from composer.behavior import Behavior
from std_msgs.msg import Int64
from tests.ros.support.sequences import Sequences, number

WRITERS = itertools.count(1)

class Writer(Behavior):
    '''A writer of its own for the timers and for each of two threads.'''

    def on_activate(self):
        self.next = {}
        self.senders = [self.publishers[name] for name in dir(self.publishers)]
        self.ended = False
        self.own = next(WRITERS)
        self.threads = [threading.Thread(target=self.run, args=(next(WRITERS),)) for _ in range(2)]
        for thread in self.threads:
            thread.start()

    def send(self, writer):
        sequence = self.next.get(writer, 0)
        self.next[writer] = sequence + 1
        for publisher in self.senders if sequence % 2 else reversed(self.senders):
            publisher.publish(Int64(data=number(writer, sequence)))

    def run(self, writer):
        while not self.ended:
            self.send(writer)
            time.sleep(0.01)

    def on_tick(self):
        if not self.ended:
            self.send(self.own)

    def on_burst(self):
        for _ in range(0 if self.ended else 50):
            self.send(self.own)

    def end(self):
        self.ended = True
        for thread in self.threads:
            thread.join()

    def on_deactivate(self):
        self.end()

class Reader(Behavior):
    def on_configure(self):
        self.seen = {"/stream": Sequences(), "/control": Sequences(), "/calm": Sequences()}

    def on_stream(self, message):
        self.seen["/stream"].take(message.data)

    def on_control(self, message):
        self.seen["/control"].take(message.data)

    def on_calm(self, message):
        self.seen["/calm"].take(message.data)
"""


def behaviors(system: RunningSystem, *names: str) -> list[Any]:
    return [system.behavior(name) for name in names]


class Stress:
    """Listeners and talkers that join, leave and are killed, in turn."""

    def __init__(self, system: RunningSystem, folder: Path) -> None:
        self._system = system
        self._folder = folder
        #: What is missing where every message is owed. Others lose by chance: once a packet is
        #: lost, a reader of ten messages loses all the others that come before it is repeated.
        self.owed = Missing()
        self._reliable_talkers: set[int] = set()

    def run(self, rounds: int) -> None:
        """Start and stop as many of both, half of them by SIGKILL."""
        for turn in range(rounds):
            profile = PROFILES[turn % len(PROFILES)]
            killed = (turn + turn // len(PROFILES)) % 2 == 1
            talker = FIRST_TALKER + turn
            if profile == OWED:
                self._reliable_talkers.add(talker)
            received = self._visit(profile, talker, killed=killed)
            if profile == OWED:
                self.owed.add_all(received)
            else:
                for numbers in received.values():
                    sequences_of(numbers)  # none twice or out of order
            if not killed:
                wait_until(self._is_alone, "no external node")

    def verify(self) -> None:
        """Stop the writers, and check that each reader has received everything."""
        sent = {name: self._sent_by(name) for name in WRITERS}
        everything = sent["writer"] | sent["second"]
        for name in ("near", "far", "guest"):
            self._verify(name, STREAM, everything)
        self._verify("pooled", "/calm", sent["second"])
        for name in ("near", "guest"):
            self._count_talkers(name)
        assert self.owed.stream == 0 or self.owed.control > 0, self.owed.stream

    def _visit(
        self, profile: tuple[str, int], talker: int, *, killed: bool
    ) -> dict[str, list[int]]:
        with (
            ExternalProcess("listen", profile, 0, self._folder) as listening,
            ExternalProcess("talk", profile, talker, self._folder) as talking,
        ):
            wait_until(lambda: all(talker in seen.last for seen in self._seen(profile)), "a talker")
            wait_until(lambda: listening.has_received(1), "a listener")
            for _ in range(MOVES):
                self._move_the_guest()
            wait_until(lambda: listening.has_received(ENOUGH), "a listener")
            codes = [process.go(killed=killed) for process in (talking, listening)]
            assert codes == ([-9, -9] if killed else [0, 0])
        return listening.received

    def _seen(self, profile: tuple[str, int]) -> Iterator[Sequences]:
        """Yield what the in-process readers that match an external node have received."""
        names = ("near", "far") if profile[0] == "RELIABLE" else ("far",)
        for reader in behaviors(self._system, *names):
            yield from (reader.seen[topic] for topic in TOPICS)

    def _move_the_guest(self) -> None:
        """Remove and restore an in-process reader while an external node listens."""
        (guest,) = behaviors(self._system, "guest")
        wait_until(lambda: guest.seen[STREAM].count > 0, "the guest")
        self._system.change("guest", "deactivate")
        seen = guest.seen[STREAM]
        assert seen.disordered == []
        assert all(writer >= FIRST_TALKER for writer in seen.missing)
        self._count_talkers("guest")
        self._system.change("guest", "cleanup", "configure", "activate")

    def _count_talkers(self, name: str) -> None:
        """Compare the messages of reliable external nodes; missing ones must be lost by DDS."""
        (reader,) = behaviors(self._system, name)
        stream, control = (
            {
                writer: count
                for writer, count in reader.seen[topic].missing.copy().items()
                if writer in self._reliable_talkers
            }
            for topic in TOPICS
        )
        self.owed.add_counted(stream, control)

    def _is_alone(self) -> bool:
        """Return whether the publishers match only the three in-process subscriptions."""
        publishers = [self._system.publisher(name, "stream") for name in WRITERS]
        return all(publisher.get_subscription_count() == 3 for publisher in publishers)

    def _sent_by(self, name: str) -> dict[int, int]:
        """Stop a node that writes; return the last message of each of its writers."""
        (behavior,) = behaviors(self._system, name)
        self._system.node(name).loop.run(behavior.end)
        assert len(behavior.next) == 3
        return {writer: count - 1 for writer, count in behavior.next.items()}

    def _verify(self, name: str, topic: str, wanted: dict[int, int]) -> None:
        (reader,) = behaviors(self._system, name)
        seen = reader.seen[topic]
        wait_until(lambda: wanted.items() <= seen.last.items(), f"all for {name}")
        assert seen.disordered == []
        assert not seen.missing.keys() & wanted.keys()
        assert self._system.node(name).statistics.queue_drops == 0


@pytest.mark.parametrize(
    "rounds", [2, pytest.param(50, marks=[pytest.mark.soak, pytest.mark.timeout(900)])]
)
def test_external_nodes_do_not_disturb_in_process_delivery(tmp_path: Path, rounds: int) -> None:
    with running(TEXT, tmp_path, stress=MODULE) as system:
        stress = Stress(system, tmp_path)
        stress.run(rounds)
        stress.verify()
