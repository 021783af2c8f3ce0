"""Signals end the wait of the main thread whenever they arrive; how a process starts."""

from __future__ import annotations

import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from composer.runtime.process.signals import READY, ServiceManager

ROUNDS = 20_000
SENDER = """
import os, signal
while os.read(0, 1):
    os.kill(os.getppid(), signal.SIGTERM)
"""
RECEIVER = f"""
import os, random, subprocess, sys, time
from composer.runtime.clock import COMPUTER
from composer.runtime.supervision.main_queue import MainQueue
from composer.runtime.process.signals import stop_signals

main_queue = MainQueue(COMPUTER)
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


@pytest.mark.parametrize("address", ["notify", "\0composer-test"])
def test_messages_arrive_at_its_socket(
    address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as service_manager:
        service_manager.bind(address)
        environment = {"NOTIFY_SOCKET": address.replace("\0", "@"), "HOME": "/"}
        service = ServiceManager(environment)
        assert environment == {"HOME": "/"}  # children do not inherit it
        service.send(READY, "STATUS=all nodes are up")
        assert service_manager.recv(1000) == b"READY=1\nSTATUS=all nodes are up"
    service.send(READY)  # it is gone
    ServiceManager({}).send(READY)  # there is none


CODE = """
import os, sys, time
from composer.runtime.process.computer import process_start_s
if len(sys.argv) == 1:
    os.execv(sys.executable, [sys.executable, __file__, "again"])
print(process_start_s(), time.monotonic())
"""


def test_a_process_starts_once_although_python_starts_twice(tmp_path: Path) -> None:
    script = tmp_path / "a (b) c.py"
    script.write_text(CODE)
    before_s = time.monotonic()
    done = subprocess.run(
        [sys.executable, script], check=True, capture_output=True, text=True, timeout=100
    )
    start_s, end_s = map(float, done.stdout.split())
    assert before_s - 0.02 <= start_s <= end_s
    assert start_s - before_s < (end_s - before_s) / 2  # before Python has started once
