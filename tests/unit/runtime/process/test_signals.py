"""Signals end the wait of the main thread whenever they arrive."""

from __future__ import annotations

import subprocess
import sys

import pytest

ROUNDS = 20_000
SENDER = """
import os, signal
while os.read(0, 1):
    os.kill(os.getppid(), signal.SIGTERM)
"""
RECEIVER = f"""
import os, random, subprocess, sys, time
from composer.runtime.supervision.main_queue import MainQueue
from composer.runtime.process.signals import stop_signals

main_queue = MainQueue()
sender = subprocess.Popen([sys.executable, "-c", '''{SENDER}'''], stdin=subprocess.PIPE)
with stop_signals(main_queue.request_stop, main_queue.wakeup, ends_process=True):
    for _ in range({ROUNDS}):
        os.write(sender.stdin.fileno(), b"!")
        until_s = time.perf_counter() + random.uniform(0.0, 100e-6)  # the signal is on its way
        while time.perf_counter() < until_s:
            pass
        while not main_queue.stopping:
            main_queue.get()
        print(main_queue.stop_reason)
        main_queue.stop_reason = None
"""


@pytest.mark.slow  # 20 000 signals
def test_a_signal_just_before_a_wait_ends_it() -> None:
    ended = subprocess.run(
        [sys.executable, "-c", RECEIVER], capture_output=True, text=True, timeout=60.0, check=False
    )
    assert (ended.stdout, ended.stderr) == ("SIGTERM\n" * ROUNDS, "")
