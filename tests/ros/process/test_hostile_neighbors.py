"""A system among hostile processes: nothing ends, pauses, or is moved by them."""

from __future__ import annotations

import os
import signal
import time
from contextlib import ExitStack
from pathlib import Path

import pytest
from std_msgs.msg import Float64, String
from std_srvs.srv import Trigger

from tests.ros.support.commands import hand_written, running
from tests.ros.support.in_process import Peer, wait_until

SYSTEM = """
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
MODULE = """
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
    path = tmp_path / "hardy.yaml"
    path.write_text(SYSTEM, encoding="utf-8")
    path.with_suffix(".py").write_text(MODULE, encoding="utf-8")
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
