"""Systems in virtual time: the same run every time, byte by byte."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from geometry_msgs.msg import Twist
from rclpy.qos import qos_profile_sensor_data
from rosgraph_msgs.msg import Clock

from composer.runtime.process import StartRefused
from composer.runtime.supervision.virtual_time import check_virtual_time
from tests.cli.compose import compose as in_process
from tests.ros.supervision.test_external_transitions import busy_processors
from tests.ros.support.commands import COMPOSE, compose
from tests.ros.support.in_process import Peer, system_of, wait_until
from tests.ros.support.system_process import RunningSystem, write_system

#: Timers, sleeps, calls that time out, a node that is restarted, a parallel executor, and stamps.
SYSTEM = """
system: recorded
executors: {pool: {kind: multi_threaded, threads: 3}}
lifecycle: {on_failure: restart, restart: {max_attempts: 5, window_ms: 20000, backoff_ms: 500}}
nodes:
  source:
    behavior: parts:Source
    publishers: {data: {type: std_msgs/msg/Header}}
    clients: {decide: {type: std_srvs/srv/SetBool, timeout_ms: 300}}
    timers: {tick: {period_ms: 70}, ask: {period_ms: 500}}
  server:
    executor: pool
    behavior: parts:Server
    services: {decide: {type: std_srvs/srv/SetBool}}
  flaky:
    publishers: {scan: {type: std_msgs/msg/String}}
    timers: {measure: {rate_hz: 10, when: count < 30, publish: {scan: {data: "scan {count}"}}}}
    lifecycle: {watch: {topic_silence_ms: 1000}}
  recorder:
    executor: pool
    behavior: parts:Recorder
    subscriptions: {data: {type: std_msgs/msg/Header}, scan: {type: std_msgs/msg/String}}
    lifecycle: {depends_on: [flaky]}
connections:
  - {topic: /data, from: source.data, to: recorder.data}
  - {topic: /scan, from: flaky.scan, to: recorder.scan}
  - {service: /decide, server: server.decide, clients: source.decide}
"""
PARTS = """
import random

import numpy
from rclpy.serialization import serialize_message
from std_msgs.msg import Header
from std_srvs.srv import SetBool

from composer.behavior import Behavior, CallError


class Source(Behavior):
    def on_tick(self):
        self.publishers.data.publish(Header(stamp=self.clock.stamp(), frame_id="map"))

    async def on_ask(self):
        try:
            answer = await self.clients.decide.call(SetBool.Request(data=True))
            self.log.info(f"answer: {answer.message}")
        except CallError as error:
            self.log.info(f"no answer: {error}")
        self.log.info(f"dice: {random.random()} {numpy.random.random()}")


class Server(Behavior):
    def on_activate(self):
        self.requests = 0

    async def on_decide(self, request, response):
        self.requests += 1
        await self.clock.sleep(0.1 * (self.requests % 5))
        response.message = f"request {self.requests}"
        return response


class Recorder(Behavior):
    def on_data(self, message):
        self.log.info(serialize_message(message).hex())

    def on_scan(self, message):
        self.log.info(serialize_message(message).hex())
"""


OPTIONS = ("--time", "virtual", "--for", "20")


def run(system: Path, hash_seed: str, *options: str) -> tuple[str, str]:
    """Run a system for 20 s of virtual time, in a new interpreter; return what it prints."""
    command = (*COMPOSE, "run", str(system), *OPTIONS, *options)
    environment = os.environ | {"PYTHONHASHSEED": hash_seed}
    done = subprocess.run(
        command, env=environment, capture_output=True, text=True, timeout=60, check=True
    )
    return done.stdout, done.stderr


def log_of(system: Path, *options: str) -> str:
    """Run a system for 20 s of virtual time; return its log."""
    done = compose("run", system, *OPTIONS, *options)
    assert done.returncode == 0, done.stderr
    return done.stderr


def test_the_same_run_byte_by_byte_whatever_the_hash_seed(tmp_path: Path) -> None:
    system = write_system(tmp_path, SYSTEM, parts=PARTS)
    first = run(system, "0")
    log = first[1]
    assert log.count("[recorder] 0001") > 280
    assert "/flaky failed: silent for 1000 ms; restart 2" in log
    assert "answer: request 1" in log
    assert "no answer: service '/decide' did not answer within 300 ms" in log
    assert "[19." in log
    assert run(system, "1", "--seed", "0") == first
    dice = {*re.findall("dice: (.*)", log)}
    assert len(dice) == 40
    assert dice.isdisjoint(re.findall("dice: (.*)", log_of(system, "--seed", "1")))


def messages_and_log(name: str, hash_seed: int, python: str = sys.executable) -> str:
    """Run an example for 20 s of virtual time; return all that happens."""
    done = subprocess.run(
        (python, "-m", "tests.ros.programs.virtual_run", f"systems/{name}.yaml", "20"),
        env=os.environ | {"PYTHONHASHSEED": str(hash_seed)},
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    return done.stdout


@pytest.mark.soak
@pytest.mark.timeout(1800)
@pytest.mark.parametrize(
    "name", ["pipeline", "navigation", "supervised", "fleet", "toolbox", "frames"]
)
def test_fifty_runs_of_examples_are_one(name: str) -> None:
    # Another Python with all that this one has, such as the next version.
    pythons = [sys.executable, *filter(None, [os.environ.get("COMPOSE_OTHER_PYTHON")])]
    first = messages_and_log(name, 0)
    assert "active" in first
    for is_busy in (False, True):
        with busy_processors(2 * is_busy):
            for hash_seed in range(25):
                for python in pythons:
                    assert messages_and_log(name, hash_seed, python) == first


@pytest.mark.parametrize("name", ["pipeline", "supervised"])
def test_examples_take_a_minute_in_a_moment(name: str) -> None:
    done = compose("run", f"systems/{name}.yaml", "--time", "virtual", "--for", "60")
    assert "[60.000] [INFO] [compose] shutting down: --for elapsed" in done.stderr
    assert "ran for 60.0 s" in done.stderr


#: ``source`` publishes for a second, is silent for one, and publishes again. ``late`` joins again
#: at 0.8 s, and at 1.8 s, when the map has expired.
TIMED = """
system: timed
nodes:
  source:
    publishers:
      scan: {type: std_msgs/msg/String, qos: &scan {deadline_ms: 100}}
      beat: {type: std_msgs/msg/String, qos: &beat
        {liveliness: manual_by_topic, liveliness_lease_duration_ms: 200}}
      map: {type: std_msgs/msg/String, qos: {durability: transient_local, lifespan_ms: 600}}
    timers:
      tick:
        period_ms: 50
        when: count < 20 or count > 40
        publish: {scan: {data: x}, beat: {data: x}}
      draw: {period_ms: 500, when: count == 0, publish: {map: {data: a map}}}
  sink:
    subscriptions:
      scan: {type: std_msgs/msg/String, qos: *scan}
      beat: {type: std_msgs/msg/String, qos: *beat}
  late:
    behavior: parts:Late
    subscriptions: {map: {type: std_msgs/msg/String, qos: {durability: transient_local}}}
    timers: {fail: {period_ms: 600}}
    lifecycle: {on_failure: restart, restart: {backoff_ms: 200}}
connections:
  - {topic: /scan, from: source.scan, to: sink.scan}
  - {topic: /beat, from: source.beat, to: sink.beat}
  - {topic: /map, from: source.map, to: late.map}
"""
LATE = """
from composer.behavior import Behavior


class Late(Behavior):
    def on_map(self, message):
        self.log.info(message.data)

    def on_fail(self):
        if self.clock.now() < 1e9 + 2.0:
            self.fail("joins again")
"""
WARNED = [
    "[1.100] [WARN] [source] publisher 'scan' on /scan: nothing was published within its deadline"
    " of 100 ms",
    "[1.100] [WARN] [sink] subscription 'scan' on /scan: nothing was received within its deadline"
    " of 100 ms; it is published by /source",
    "[1.200] [WARN] [source] publisher 'beat' on /beat: it did not assert its liveliness within its"
    " lease of 200 ms",
    "[1.200] [WARN] [sink] subscription 'beat' on /beat: a publisher did not assert its liveliness"
    " within the lease of 200 ms; it is published by /source",
]


def test_deadlines_leases_and_lifespans_are_those_of_virtual_time(tmp_path: Path) -> None:
    system = write_system(tmp_path, TIMED, parts=LATE)
    log = log_of(system).splitlines()
    assert [line for line in log if "[WARN]" in line and "[late]" not in line] == WARNED
    maps = [line for line in log if line.endswith("[late] a map")]
    assert maps == ["[0.500] [INFO] [late] a map", "[0.800] [INFO] [late] a map"]


ENDLESS = [
    (
        "{x: {publishers: {a: {type: std_msgs/msg/Empty}},"
        " subscriptions: {b: {type: std_msgs/msg/Empty, publish: {a: {}}}},"
        " timers: {start: {period_ms: 1000, publish: {a: {}}}}},"
        " y: {publishers: {b: {type: std_msgs/msg/Empty}},"
        " subscriptions: {a: {type: std_msgs/msg/Empty, publish: {b: {}}}}}}\n"
        "connections: [{topic: /a, from: x.a, to: y.a}, {topic: /b, from: y.b, to: x.b}]",
        r"because callbacks cause each other without end: /x subscription 'b' \(\d+ calls\),"
        r" /y subscription 'a' \(\d+ calls\)",
    ),
    (
        "{x: {behavior: parts:Endless, timers: {start: {period_ms: 1000}}}}",
        r"because a callback goes on without waiting at \S+/parts.py:7",
    ),
]
PART_WITHOUT_END = """
from composer.behavior import Behavior

class Endless(Behavior):
    async def on_start(self):
        while True:
            await self.clock.sleep(0)
"""


@pytest.mark.parametrize(("nodes", "reason"), ENDLESS)
def test_a_system_whose_time_does_not_advance_ends(tmp_path: Path, nodes: str, reason: str) -> None:
    system = write_system(tmp_path, f"system: endless\nnodes: {nodes}\n", parts=PART_WITHOUT_END)
    done = compose("run", str(system), "--time", "virtual", "--for", "60")
    assert done.returncode == 1
    assert re.search(rf"ran for 1.0 s: the time does not advance, {reason}", done.stderr)


#: Waits in real time, and uses no CPU time.
HANGS = """
from select import select
from composer.behavior import Behavior

class Hangs(Behavior):
    def on_start(self):
        self.log.info("it hangs")
        while True:
            select((), (), (), 0.01)
"""


def test_a_callback_that_does_not_return_is_interrupted_at_the_end(tmp_path: Path) -> None:
    node = "{behavior: parts:Hangs, timers: {start: {period_ms: 1000}}}"
    system = write_system(tmp_path, f"system: hangs\nnodes: {{x: {node}}}\n", parts=HANGS)
    with RunningSystem(str(system), "--time", "virtual", "--for", "5") as running:
        running.wait_for("it hangs")
        assert running.stop()[0] == 0
        assert re.search(r"on_start is interrupted; it is at \S+parts.py:[89]", running.output)


#: What is not of virtual time, by its line.
OUTSIDE = """
import os, random, socket, subprocess, threading, time, uuid
from concurrent.futures import ThreadPoolExecutor
from time import monotonic
from composer.behavior import Behavior

class Outside(Behavior):
    def on_activate(self):
        for _ in range(2):
            time.time()
            monotonic()
            time.sleep(0)
            os.urandom(1)
            uuid.uuid4()
            random.Random()
            socket.socket().close()
            ThreadPoolExecutor(1).submit(int).result()
            threading.Thread(target=int).start()
            subprocess.run(["true"])
        random.Random(1).random()
        self.log.info(f"{self.clock.now()}")
"""
NOTICED = (
    *("time.time()", "time.monotonic()", "time.sleep()", "os.urandom()", "uuid.uuid4()"),
    *("random.Random", "a socket", "a thread", "a thread", "a process"),
)


def test_what_virtual_time_does_not_control_is_named_once(tmp_path: Path) -> None:
    system = write_system(
        tmp_path, "system: outside\nnodes: {x: {behavior: parts:Outside}}\n", parts=OUTSIDE
    )
    log = log_of(system)
    uses = re.findall(r"parts.py:(\d+) uses (.*), which virtual time does not control; use", log)
    assert uses == [(str(line), name) for line, name in enumerate(NOTICED, 10)]


def test_external_nodes_take_part_in_a_system_that_publishes_its_clock(peer: Peer) -> None:
    options = ("--time", "virtual", "--speed", "2", "--publish-clock")
    with RunningSystem("systems/pipeline.yaml", *options) as system:
        times = peer.listen(Clock, "/clock", qos_profile_sensor_data)
        commands = peer.listen(Twist, "/motor_commands")
        wait_until(lambda: len(times) > 100 and len(commands) > 10)
        seconds = [message.clock.sec for message in times]
        assert 10**9 <= seconds[0] <= seconds[-1] < 10**9 + 3600
        assert peer.change("/planning/planner", "deactivate")
        system.wait_for("/planning/planner inactive")
        assert system.stop()[0] == 0


REFUSED = [
    ("battery: {external: true}", "/battery is an external node, which has the time of the"),
    ("camera: {executable: {command: [camera]}}", "/camera is an executable, which has the time"),
    (
        "{a: {publishers: {x: {type: std_msgs/msg/String}}},"
        " b: {subscriptions: {x: {type: std_msgs/msg/String}}}}\n"
        "connections: [{topic: /x, from: a.x, to: b.x, delivery: dds}]",
        "topic /x needs the middleware: 'delivery: dds' is set",
    ),
]


@pytest.mark.parametrize(("nodes", "reason"), REFUSED)
def test_what_has_the_time_of_the_computer_is_refused(
    tmp_path: Path, nodes: str, reason: str
) -> None:
    nodes = nodes if nodes.startswith("{") else f"{{{nodes}}}"
    system = system_of(f"system: refused\nnodes: {nodes}\n", tmp_path)
    with pytest.raises(StartRefused, match=f"refused cannot run in virtual time: {reason}"):
        check_virtual_time(system)


@pytest.mark.parametrize(
    ("options", "error"),
    [
        (("virtual",), "--time virtual needs --for or --speed"),
        (("virtual", "--for", "1", "--wait"), "--wait cannot be used with --time virtual"),
        (("virtual", "--for", "1", "--process", "x"), "--process cannot be used with --time"),
        (("virtual", "--for", "1", "--dashboard"), "add --publish-clock"),
        (("real", "--speed", "2"), "--speed needs --time virtual"),
        (("real", "--publish-clock"), "--publish-clock needs --time virtual"),
    ],
)
def test_options_of_another_time_are_refused(options: tuple[str, ...], error: str) -> None:
    done = in_process("run", "systems/minimal.yaml", "--time", *options)
    assert (done.code, error in done.err) == (2, True)
