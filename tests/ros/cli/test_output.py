"""The output of a running system: what nothing reads does not stop it."""

from __future__ import annotations

import fcntl
import os
import signal
import subprocess
from pathlib import Path
from textwrap import dedent

import pytest
from std_msgs.msg import Int64

from tests.ros.support.commands import COMPOSE, PATIENCE_S
from tests.ros.support.in_process import Peer, wait_until

LOUD = """
system: loud
nodes:
  loud:
    behavior: loud:Loud
    publishers: {beat: {type: std_msgs/msg/Int64, external: true}}
    timers: {tick: {period_ms: 5}}
"""
MODULE = """
import sys
import rclpy.logging
from composer.behavior import Behavior
from std_msgs.msg import Int64

class Loud(Behavior):
    beats = 0

    def on_tick(self):
        self.beats += 1
        self.log.info("x" * 10_000)
        print("y" * 10_000)
        print("z" * 10_000, file=sys.stderr)
        rclpy.logging.get_logger("rcl").error("c" * 100)
        self.publishers.beat.publish(Int64(data=self.beats))
"""


@pytest.fixture
def loud(tmp_path: Path) -> Path:
    path = tmp_path / "loud.yaml"
    path.write_text(dedent(LOUD), encoding="utf-8")
    path.with_suffix(".py").write_text(dedent(MODULE), encoding="utf-8")
    return path


def test_a_system_whose_output_nothing_reads_runs_and_ends_in_time(loud: Path, peer: Peer) -> None:
    reading, writing = os.pipe()
    fcntl.fcntl(writing, fcntl.F_SETPIPE_SZ, 4096)
    process = subprocess.Popen([*COMPOSE, "run", str(loud)], stdout=writing, stderr=writing)
    os.close(writing)
    try:
        beats = peer.listen(Int64, "/beat")
        wait_until(lambda: beats and beats[-1].data > 50, "beats while the output is blocked")
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE_S) == 0, "with the time limit of the shutdown, it is 1"
    finally:
        process.kill()
        process.wait()
        os.close(reading)


def test_a_closed_stderr_does_not_change_the_exit_code(loud: Path) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    command = [*COMPOSE, "run", str(loud), "--for", "0.1"]
    done = subprocess.run(command, stdout=writing, stderr=writing, check=False, timeout=PATIENCE_S)
    os.close(writing)
    assert done.returncode == 0
