"""Whoever joins, leaves or dies outside: inside, nothing is lost, doubled or out of order."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from tests.ros.system_bench import RunningSystem, running, wait_until

PEER = "tests.ros.delivery_peer"
WRITERS = ("writer", "second")
ROOT = Path(__file__).parents[2]

TEXT = """
system: stress
executors: {other: {}, pool: {kind: multi_threaded, threads: 2}}
qos_profiles:
  deep: {depth: 5000}
  unreliable: {depth: 5000, reliability: best_effort}
nodes:
  writer:
    behavior: stress:Writer
    publishers: {stream: {type: std_msgs/msg/Int64, topic: /stream, qos: deep}}
    timers: {tick: {rate_hz: 1000}, burst: {period_ms: 200}}
  second:
    behavior: stress:Writer
    executor: other
    publishers:
      stream: {type: std_msgs/msg/Int64, topic: /stream, qos: deep}
      calm: {type: std_msgs/msg/Int64, topic: /calm, qos: deep}
    timers: {tick: {rate_hz: 100}, burst: {period_ms: 500}}
  near:
    behavior: stress:Reader
    subscriptions: {stream: {type: std_msgs/msg/Int64, topic: /stream, qos: deep}}
  far:
    behavior: stress:Reader
    executor: other
    subscriptions: {stream: {type: std_msgs/msg/Int64, topic: /stream, qos: unreliable}}
  pooled:
    behavior: stress:Reader
    executor: pool
    subscriptions: {stream: {type: std_msgs/msg/Int64, topic: /calm, qos: deep}}
"""
MODULE = """
import itertools
import threading
import time

from composer.behavior import Behavior
from std_msgs.msg import Int64
from tests.ros.sequences import Sequences, number

WRITERS = itertools.count(1)

class Writer(Behavior):
    '''A writer of its own for the timers and for each of two threads.'''

    def on_activate(self):
        self.next = {}
        self.outlets = [self.publishers[name] for name in dir(self.publishers)]
        self.ended = False
        self.own = next(WRITERS)
        self.threads = [threading.Thread(target=self.run, args=(next(WRITERS),)) for _ in range(2)]
        for thread in self.threads:
            thread.start()

    def send(self, writer):
        sequence = self.next.get(writer, 0)
        self.next[writer] = sequence + 1
        for publisher in self.outlets:
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
        self.seen = Sequences()

    def on_stream(self, message):
        self.seen.take(message.data)
"""


@contextmanager
def outside(*arguments: object) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", PEER, *map(str, arguments)]
    environment = {**os.environ, "PYTHONPATH": f"{ROOT}:{os.environ.get('PYTHONPATH', '')}"}
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def behaviors(system: RunningSystem, *names: str) -> list[Any]:
    return [system.host._crew.nodes[name]._behavior for name in names]


def said(process: subprocess.Popen[str], wanted: str) -> bool:
    assert process.stdout is not None
    return any(line.strip() == wanted for line in process.stdout)


def stress(system: RunningSystem, rounds: int) -> None:
    """Have listeners and talkers join, leave in order, and be killed, by turns."""
    readers = behaviors(system, "near", "far")
    for turn in range(rounds):
        talker = 100 + turn
        with outside("listen", "/stream") as listener, outside("talk", "/stream", talker) as talks:
            assert said(listener, "heard")
            assert said(talks, "matched")
            wait_until(lambda t=talker: all(t in reader.seen.last for reader in readers))
            talks.kill()
            if turn % 2 == 0:
                output, _ = listener.communicate(timeout=20.0)  # closes its standard input
                seen = json.loads(output.strip().splitlines()[-1])
                assert seen["count"] > 0
                assert seen["wrong"] == []


def verify(system: RunningSystem) -> None:
    """Have the writers end, and see that each reader has got everything there was for it."""
    sent: dict[str, dict[int, int]] = {}
    for name, writer in zip(WRITERS, behaviors(system, *WRITERS), strict=True):
        system.host._crew.nodes[name].loop.run(writer.end)
        sent[name] = {key: count - 1 for key, count in writer.next.items()}
        assert len(sent[name]) == 3
    everything = sent["writer"] | sent["second"]
    for name, wanted in (("near", everything), ("far", everything), ("pooled", sent["second"])):
        (reader,) = behaviors(system, name)
        seen = reader.seen
        wait_until(lambda s=seen, w=wanted: w.items() <= s.last.items(), f"all for {name}")
        assert seen.wrong == []
        assert seen.count == sum(seen.last[key] - seen.first[key] + 1 for key in seen.last)
        assert system.host._crew.nodes[name].statistics.queue_drops == 0


@pytest.mark.parametrize(
    "rounds", [2, pytest.param(50, marks=[pytest.mark.soak, pytest.mark.timeout(900)])]
)
def test_a_stress_of_outsiders_changes_nothing_inside(tmp_path: Path, rounds: int) -> None:
    with running(TEXT, tmp_path, stress=MODULE) as system:
        stress(system, rounds)
        verify(system)
