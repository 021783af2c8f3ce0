"""Systems for minutes, with everything around them that goes wrong: nothing grows or hangs."""

from __future__ import annotations

import os
import random
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import pytest
from std_msgs.msg import Float64, String
from std_srvs.srv import Trigger

from tests.ros.dashboard.test_foxglove_limits import raw
from tests.ros.process.test_restarts import PROGRAMS, SYSTEM, TALKER, Usage, children, usage
from tests.ros.support.commands import compose, hand_written, running
from tests.ros.support.dashboard import Dashboard
from tests.ros.support.in_process import Peer, wait_until
from tests.ros.support.system_process import PATIENCE_S, RunningSystem, write_system

#: Restarts of everything, several times as often as the system waits before the next one.
RESTARTS = "{max_attempts: 10000, window_ms: 3600000, backoff_ms: 20, backoff_max_ms: 200}"
KILL_PERIOD_S = 3.0
KILLS = 10
#: The system, its dashboard, the launcher, the executable, the other process, and two watchdogs.
PROCESSES = 7
#: Of the system, and of the dashboard next to it, which joins and leaves the ROS graph. In 100
#: kills they take 3 and 2 MB. A plain rclpy program that joins and leaves takes 9 MB, and 0.5 MB
#: if it stays: glibc keeps free memory, which the dashboard returns.
MEMORY_MB, DASHBOARD_MB = 8.0, 4.0
SPARE_THREADS = 2


@contextmanager
def lifecycle_client(node: str) -> Iterator[list[int]]:
    """Move a node up and down with commands, as a user with a script; collect the exit codes."""
    has_ended, codes = threading.Event(), list[int]()

    def run() -> None:
        while not has_ended.is_set():
            for transition in ("deactivate", "activate"):
                codes.append(compose("lifecycle", "set", node, transition).returncode)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield codes
    finally:
        has_ended.set()
        thread.join()


def wait_until_up(system: RunningSystem) -> None:
    """Wait until every node is active, or was deactivated by a client and is about to return."""
    end_s = time.monotonic() + PATIENCE_S
    while compose("ps").stdout.count(" active") < len(("driver", "talker", "other")):
        assert system.process.poll() is None, "the system has ended"
        assert time.monotonic() < end_s, compose("ps").stdout
        time.sleep(0.2)  # poll: each look is a command


def steady(pid: int, processes: int) -> Usage:
    """Return the usage of a process and its descendants once it does not change any more."""
    end_s = time.monotonic() + PATIENCE_S
    before: Usage | None = None
    while True:
        time.sleep(2.0)  # poll: nothing announces that everything has restarted
        now = usage(pid)
        same = before is not None and before.descriptors == now.descriptors
        if (same and now.processes == processes) or time.monotonic() > end_s:
            return now
        before = now


@pytest.mark.soak
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("seconds", [30, 600])
def test_kills_of_any_process(seconds: int, tmp_path: Path) -> None:
    seed = random.randrange(2**32)
    chance = random.Random(seed)
    text = SYSTEM.replace("PYTHON", sys.executable).replace("PROGRAMS", str(PROGRAMS))
    text += f"lifecycle: {{on_failure: restart, restart: {RESTARTS}}}\n"
    path = write_system(tmp_path, text, talker=TALKER)
    with RunningSystem(str(path), "--dashboard") as system:
        system.wait_for("3 of 3 nodes active")
        pid = system.process.pid
        dashboard = Dashboard()
        own_dashboard = next(child for child in children(pid)[1:] if has_word(child, "dashboard"))

        def kill_one() -> None:
            """Kill a launcher, an executable or a process of the system."""
            victims = [child for child in children(pid)[1:] if child != own_dashboard]
            with suppress(ProcessLookupError):
                os.kill(chance.choice(victims), signal.SIGKILL)
            wait_until_up(system)

        def kill_some(times: int) -> None:
            """Kill with a client that stalls, and which the dashboard drops after a while."""
            options = {"max_queue": 1, "close_timeout": 0, "ping_interval": None}
            with raw(dashboard.address, **options) as stalled:
                stalled.subscribe("/chatter")
                for _ in range(times):
                    kill_one()
                    time.sleep(KILL_PERIOD_S)  # the period of the kills

        def disturb(seconds: float) -> None:
            end_s = time.monotonic() + seconds
            with lifecycle_client("talker") as codes, lifecycle_client("driver") as more_codes:
                kill_some(KILLS)
                while time.monotonic() < end_s:
                    kill_some(KILLS)
                    with suppress(FileNotFoundError):  # a process ends just now
                        print(f"{end_s - time.monotonic():.0f} s left", usage(pid), flush=True)
            for each in (codes, more_codes):
                assert set(each) <= {0, 1}
                assert each.count(0) > 0

        disturb(0.0)
        first, first_of_dashboard = steady(pid, PROCESSES), steady(dashboard.process.pid, 1)
        disturb(seconds)
        last, of_dashboard = steady(pid, PROCESSES), steady(dashboard.process.pid, 1)
        print(f"seed {seed}", first, last, first_of_dashboard, of_dashboard, sep="\n")
        for before, after, memory_mb in (
            (first, last, MEMORY_MB),
            (first_of_dashboard, of_dashboard, DASHBOARD_MB),
        ):
            assert after.zombies == 0
            assert after.descriptors <= before.descriptors
            assert after.threads <= before.threads + SPARE_THREADS
            assert after.memory_mb - before.memory_mb < memory_mb
        dashboard.process.send_signal(signal.SIGINT)
        assert dashboard.process.wait(timeout=PATIENCE_S) == 0
        system.stop()
        assert "Traceback" not in system.output + dashboard.errors()


def has_word(pid: int, word: str) -> bool:
    return word.encode() in Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")


HARDY = """
system: hardy
use_sim_time: true
nodes:
  ticker:
    behavior: hardy:Ticker
    parameters: {speed: 1.0}
    timers: {tick: {period_ms: 10, clock: steady}, report: {period_ms: 500, clock: steady}}
    publishers: {longest: {type: std_msgs/msg/Float64, external: true}}
    subscriptions: {text: {type: std_msgs/msg/String, external: true}}
  sleeper:
    lifecycle: {autostart: inactive}
    timers:
      wake: {period_ms: 10, clock: steady, publish: {silent: {data: "awake"}}}
    publishers: {silent: {type: std_msgs/msg/String, external: true}}
"""
TICKER = """
import time
from composer.behavior import Behavior
from std_msgs.msg import Float64

class Ticker(Behavior):
    def on_activate(self):
        self.last_s, self.longest_s = time.monotonic(), 0.0

    def on_tick(self):
        now_s = time.monotonic()
        self.longest_s = max(self.longest_s, now_s - self.last_s)
        self.last_s = now_s

    def on_report(self):
        self.publishers.longest.publish(Float64(data=self.longest_s))

    def on_text(self, message):
        pass
"""
NEIGHBORS = (
    ("hand_written_neighbor.py",),
    ("hand_written_odd_names.py",),
    ("hand_written_huge_requests.py", "/ticker", "forever"),
)
LONGEST_S = 0.5  # more if the machine is overloaded
MAX_LOG_LINES_PER_S = 20


@pytest.mark.soak
@pytest.mark.timeout(300)
def test_hostile_neighbors_stop_nothing(tmp_path: Path, peer: Peer) -> None:
    duration_s = 120.0
    path = write_system(tmp_path, HARDY, hardy=TICKER)
    with running(tmp_path / "log", str(path)) as system, ExitStack() as neighbors:
        system.wait_for("1 of 2 nodes active")
        longest = peer.listen(Float64, "/longest")
        silent = peer.listen(String, "/silent")
        wait_until(lambda: longest, "a report")
        for program in NEIGHBORS:
            neighbors.enter_context(hand_written(*program))
        end_s = time.monotonic() + duration_s
        while time.monotonic() < end_s:
            reports = len(longest)
            wait_until(lambda seen=reports: len(longest) > seen, "the next report")
            assert system.process.poll() is None, system.log.read_text()
        assert peer.call(Trigger, "/hardy/manager/is_active").success
        assert peer.state("/ticker") == "active"
        assert peer.state("/sleeper") == "inactive"
        neighbors.close()
        code, _, log = system.stop(signal.SIGINT)
    limit_s = LONGEST_S * max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))
    print(f"longest pause {longest[-1].data:.3f} s, {len(log.splitlines())} lines of log")
    assert code == 0, log
    assert not silent
    assert longest[-1].data < limit_s
    assert len(log.splitlines()) < MAX_LOG_LINES_PER_S * duration_s
