"""If the middleware cannot ignore local publications, all messages use DDS, each once."""

from __future__ import annotations

import ctypes
import json
import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import Int64

from composer.runtime.intra_process import dds_flags
from composer.runtime.intra_process.dds_flags import (
    RmwSubscription,
    RmwSubscriptionOptions,
    unsupported_reason,
)
from tests.ros.support.commands import COMPOSE, compose
from tests.ros.support.in_process import Peer, wait_until
from tests.ros.support.sequences import Sequences
from tests.ros.support.system_process import RunningSystem, write_system

MIDDLEWARES = Path(__file__).with_name("middlewares")
PER_WRITER, WRITERS, LATCHED = 400, 3, 3
#: Each middleware, and why it is not relied on.
REASONS = {
    "returns_local": "a local publication was received despite the flag",
    "unknown": "rmw_unknown_cpp is not supported",
}
SYSTEM = """
system: fallback
executors: {other: {}}
qos_profiles:
  deep: {depth: 5000}
  latched: {extends: state, depth: 10}
nodes:
  writer:
    behavior: counting:Writer
    lifecycle: {autostart: inactive}
    publishers:
      stream: {type: std_msgs/msg/Int64, topic: /stream, qos: deep}
      mode: {type: std_msgs/msg/Int64, topic: /mode, qos: latched}
    timers: {burst: {period_ms: 5}}
  near:
    behavior: counting:Reader
    subscriptions:
      stream: {type: std_msgs/msg/Int64, topic: /stream, qos: deep}
      mode: {type: std_msgs/msg/Int64, topic: /mode, qos: latched}
  far:
    behavior: counting:Reader
    executor: other
    subscriptions:
      stream:
        {type: std_msgs/msg/Int64, topic: /stream, qos: {extends: deep, reliability: best_effort}}
      mode: {type: std_msgs/msg/Int64, topic: /mode, qos: latched}
"""
BEHAVIORS = f"""
import json
import threading

from composer.behavior import Behavior
from std_msgs.msg import Int64
from tests.ros.support.sequences import Sequences, number

PER_WRITER, WRITERS, LATCHED = {PER_WRITER}, {WRITERS}, {LATCHED}

class Writer(Behavior):
    '''Two threads publish, and a timer, in bursts, as the third: PER_WRITER messages each.'''

    def on_activate(self):
        self.sent = 0
        for mode in range(LATCHED):
            self.publishers.mode.publish(Int64(data=mode))
        for writer in range(1, WRITERS):
            threading.Thread(target=self.run, args=(writer,)).start()

    def run(self, writer):
        for sequence in range(PER_WRITER):
            self.publishers.stream.publish(Int64(data=number(writer, sequence)))

    def on_burst(self):
        for sequence in range(self.sent, min(self.sent + 20, PER_WRITER)):
            self.publishers.stream.publish(Int64(data=number(0, sequence)))
            self.sent += 1

class Reader(Behavior):
    def on_configure(self):
        self.seen = Sequences()
        self.modes = []

    def on_stream(self, message):
        self.seen.take(message.data)
        if sum(last == PER_WRITER - 1 for last in self.seen.last.values()) == WRITERS:
            self.log.info("complete")

    def on_mode(self, message):
        self.modes.append(message.data)

    def on_deactivate(self):
        self.log.info(json.dumps([self.seen.count, self.seen.wrong, self.modes]))
"""


def compiled(source: str, target: Path, *options: str) -> Path:
    """Compile C with the headers of the installed ROS."""
    prefixes = os.environ["AMENT_PREFIX_PATH"].split(":")
    folders = [folder for prefix in prefixes for folder in Path(prefix, "include").iterdir()]
    command = ["cc", "-Wall", "-Werror", *options, *(f"-I{folder}" for folder in folders)]
    subprocess.run([*command, MIDDLEWARES / source, "-o", target, "-ldl"], check=True)
    return target


@contextmanager
def preloaded(middleware: str, folder: Path) -> Iterator[None]:
    """Make processes that start in the block use it."""
    with pytest.MonkeyPatch.context() as environment:
        library = compiled(f"{middleware}.c", folder / "library.so", "-shared", "-fPIC")
        environment.setenv("LD_PRELOAD", str(library))
        yield


def test_the_offsets_of_fields_are_those_of_the_headers(tmp_path: Path) -> None:
    program = compiled("print_layout.c", tmp_path / "print_layout")
    printed = subprocess.run([program], capture_output=True, check=True, text=True).stdout
    flag = RmwSubscription.options.offset + RmwSubscriptionOptions.ignore_local_publications.offset
    ours = (RmwSubscription.topic_name.offset, flag, ctypes.sizeof(RmwSubscription))
    assert tuple(map(int, printed.split())) == ours


@pytest.mark.parametrize("middleware", [None, *REASONS])
def test_every_message_arrives_once_with_any_middleware_and_the_doctor_reports_it(
    middleware: str | None, tmp_path: Path, peer: Peer
) -> None:
    path = write_system(tmp_path, SYSTEM, counting=BEHAVIORS)
    outside = Sequences()
    if middleware is None:
        running = RunningSystem(str(path), "--log-level", "debug")
        found = compose("doctor", "--json").stdout
    else:
        with preloaded(middleware, tmp_path):  # which only new interpreters load
            running = RunningSystem(str(path), "--log-level", "debug", program=COMPOSE)
            command = [*COMPOSE, "doctor", "--json"]
            found = subprocess.run(
                command, stdout=subprocess.PIPE, check=False, text=True, timeout=100
            ).stdout
    (checked,) = [item for item in json.loads(found) if item["area"] == "delivery"]
    with running as system:
        system.wait_for("2 of 3 nodes active")
        peer.node.create_subscription(
            Int64, "/stream", lambda message: outside.take(message.data), QoSProfile(depth=5000)
        )
        wait_until(lambda: peer.node.count_publishers("/stream"), "the publisher")
        # Endpoints are announced in order: a node that responds knows the subscription.
        assert peer.state("/writer") == "inactive"
        assert peer.change("/writer", "activate")
        for reader in ("near", "far"):
            system.wait_for(rf"\[{reader}\] complete")
        ends = dict.fromkeys(range(WRITERS), PER_WRITER - 1)
        wait_until(lambda: outside.last == ends, "the last messages, externally")
        code, _ = system.stop()
    assert code == 0, system.output
    everything = [WRITERS * PER_WRITER, [], list(range(LATCHED))]
    for reader in ("near", "far"):
        said = [line for line in system.lines if f"[{reader}] [" in line]
        assert [json.loads(line.partition(f"[{reader}] ")[2]) for line in said] == [everything]
    assert outside.wrong == []
    warned = [line for line in system.lines if "topics within the process use DDS" in line]
    by_dds = [line for line in system.lines if "uses DDS only" in line]
    if middleware is None:
        assert (warned, by_dds, checked["level"]) == ([], [], "ok")
    else:
        assert len(warned) == 1
        assert "[WARN]" in warned[0]
        assert REASONS[middleware] in warned[0]
        assert len(by_dds) == 6  # two publishers, four subscriptions
        assert all(line.endswith(REASONS[middleware]) for line in by_dds)
        assert checked["level"] == "note"
        assert checked["message"].endswith(REASONS[middleware])
        assert "'delivery: dds'" in checked["remedy"]


@pytest.mark.parametrize("reports_matches", [True, False])
def test_the_self_test_leaves_nothing_in_the_graph(
    reports_matches: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dds_flags.MATCHING, "is_supported", not reports_matches)
    if not reports_matches:
        monkeypatch.setattr(dds_flags, "EVENT", lambda *_: 0)  # it is accepted and never called
    context = Context()
    context.init([])
    node = Node("watcher", context=context)
    try:
        assert unsupported_reason.__wrapped__(context) is None
        assert dds_flags.MATCHING.is_supported == reports_matches
        found = [*node.get_service_names_and_types(), *node.get_topic_names_and_types()]
        assert [name for name, _ in found if "trial" in name] == []
    finally:
        node.destroy_node()
        context.try_shutdown()
