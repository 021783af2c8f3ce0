"""A system that records itself in every other time slice, and a program that records its topic.

The result has, for each pair of slices, the CPU time of a recorded message and the durations of the
callback that publishes; and the CPU time that the other program needs for a message.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import rclpy
from mcap.writer import Writer
from nav_msgs.msg import Odometry

from benchmarks.figures import percentile
from benchmarks.processes import RESULT_MARK
from benchmarks.programs.behaviors import DurationSource
from composer.bags.system_recording import SystemRecording
from composer.loading import load
from composer.model.qos import QosProfile
from composer.model.system import Recording
from composer.plan import bring_up, tear_down
from composer.runtime.clock import COMPUTER
from composer.runtime.host import Host
from composer.runtime.host_options import HostOptions
from composer.runtime.supervision.events import BroughtUp, Event

RATE_HZ = 1000.0
_TOPIC = "/odometry"
_SLICE_S = 1.0
#: What a slice before has left is written first.
_SETTLE_S = 0.2
_SYSTEM = f"""\
system: recorded
nodes:
  source:
    behavior: {DurationSource.__module__}:DurationSource
    publishers: {{odometry: {{type: nav_msgs/msg/Odometry, topic: {_TOPIC}, qos: command}}}}
    timers: {{tick: {{rate_hz: {RATE_HZ}}}}}
"""


class _Switched:
    """A recorder that can be turned off."""

    def __init__(self, recording: SystemRecording) -> None:
        self.is_on = False
        self._recording = recording

    def tap(self, topic: str, type_name: str, profile: QosProfile) -> Any:
        source = self._recording.tap(topic, type_name, profile)
        return None if source is None else _Switch(self, source)

    def save(self, done: Any) -> None:
        done(False, "this is a benchmark")


class _Switch:
    def __init__(self, switched: _Switched, source: Any) -> None:
        self._switched = switched
        self._source = source

    def put(self, message: Any) -> None:
        if self._switched.is_on:
            self._source.put(message)


def main() -> None:
    """Bring the system up, measure, and print the result."""
    with tempfile.TemporaryDirectory() as folder:
        if sys.argv[1] == "subscriber":
            _subscribe(Path(folder))
        else:
            print(RESULT_MARK + json.dumps(_measure(Path(folder), int(sys.argv[1]))), flush=True)


def _measure(folder: Path, pairs: int) -> dict[str, Any]:
    path = folder / "recorded.yaml"
    path.write_text(_SYSTEM, encoding="utf-8")
    system = load(path).system
    assert system is not None
    up = threading.Event()

    def on_event(event: Event) -> None:
        if isinstance(event, BroughtUp):
            up.set()

    recording = SystemRecording(system, Recording(str(folder / "bags")), COMPUTER, print)
    switched = _Switched(recording)
    options = HostOptions(recorder=switched)
    host = Host(system, bring_up(system), tear_down(system), options, report=on_event)
    with recording.running():
        threading.Thread(target=host.run, daemon=True).start()
        if not up.wait(60.0):
            sys.exit("the system did not come up")
        command = [sys.executable, "-m", "benchmarks.programs.recorded", "subscriber"]
        with subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        ) as other:
            assert other.stdout is not None
            other.stdout.readline()  # it has received the first message
            slices = [_slice(switched, is_on=number % 4 in {1, 2}) for number in range(2 * pairs)]
            output, _ = other.communicate("\n")
    return {
        "pairs": [sorted(pair) for pair in zip(slices[::2], slices[1::2], strict=True)],
        "subscriber_us": float(output),
    }


def _slice(switched: _Switched, *, is_on: bool) -> tuple[bool, float, float]:
    """Return whether it recorded, the CPU time per message, and the p99 of the callback, in us."""
    switched.is_on = is_on
    time.sleep(_SETTLE_S)
    durations = DurationSource.durations_us
    durations.clear()
    began_s = time.process_time()
    time.sleep(_SLICE_S)
    used_s = time.process_time() - began_s
    taken = durations.copy()
    return is_on, 1e6 * used_s / len(taken), percentile(taken, 0.99)


def _subscribe(folder: Path) -> None:
    """Record as a hand-written program does, and print the CPU time of a message."""
    rclpy.init()
    node = rclpy.create_node("subscriber")
    with (folder / "bag.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2", library="")
        schema = writer.register_schema("nav_msgs/msg/Odometry", "ros2msg", b"")
        channel = writer.register_channel(_TOPIC, "cdr", schema)
        count = 0
        ended = threading.Event()

        def on_message(data: bytes) -> None:
            nonlocal count
            count += 1
            now_ns = time.time_ns()
            writer.add_message(channel, now_ns, data, now_ns)

        def wait_for_end() -> None:
            sys.stdin.readline()
            ended.set()

        node.create_subscription(Odometry, _TOPIC, on_message, 100, raw=True)
        while not count:
            rclpy.spin_once(node)
        print("receiving", flush=True)
        threading.Thread(target=wait_for_end, daemon=True).start()
        executor = rclpy.get_global_executor()
        executor.add_node(node)
        before, began_s = count, time.process_time()
        while not ended.is_set():
            executor.spin_once(0.1)
        used_s = time.process_time() - began_s
        writer.finish()
    print(1e6 * used_s / (count - before), flush=True)


if __name__ == "__main__":
    main()
