"""The first signal ends a command in order, the second one at once, whatever it waits for."""

from __future__ import annotations

import array
import fcntl
import signal
import subprocess
import termios
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks.pipeline import cpu_s
from tests.ros.dashboard.test_foxglove_limits import raw
from tests.ros.support.commands import COMPOSE, hand_written
from tests.ros.support.dashboard import Address
from tests.ros.support.in_process import end_limit_s, wait_until
from tests.ros.support.system_process import PATIENCE_S, RunningSystem

#: Signals that follow more closely are those of a terminal and of a tool that forwards them.
PAUSE_S = 0.2
PIPE_BYTES = 4096
TIMERS = ", ".join(f"tick_{number}: {{period_ms: 50, log: tick}}" for number in range(30))
TALKATIVE = f"system: robot\nnodes: {{talker: {{timers: {{{TIMERS}}}}}}}\n"
STUBBORN = """
system: robot
nodes: {stubborn: {behavior: "stubborn:Stubborn", lifecycle: {timeout_ms: 60000}}}
"""
BEHAVIOR = """
import time
from composer.behavior import Behavior

class Stubborn(Behavior):
    def on_deactivate(self):
        self.log.info("deactivating")
        time.sleep(60.0)
"""

CATASTROPHE = """
system: robot
nodes: {parser: {behavior: "parser:Parser", timers: {tick: {period_ms: 100}}}}
"""
PARSER = """import re
from pathlib import Path
from composer.behavior import Behavior

class Parser(Behavior):
    def on_tick(self):
        Path(__file__).with_name("parsing").touch()
        re.match(r"(a+)+$", "a" * 60 + "b")
"""


@pytest.fixture
def talkative(tmp_path: Path) -> Iterator[None]:
    path = tmp_path / "robot.yaml"
    path.write_text(TALKATIVE, encoding="utf-8")
    with RunningSystem(str(path)) as system:
        system.wait_for("1 of 1 nodes active")
        yield


def started(*words: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [*COMPOSE, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def wait_until_full(process: subprocess.Popen[str]) -> None:
    """Wait until the output of a command fills its pipe."""
    assert process.stdout is not None
    descriptor = process.stdout.fileno()
    size, waiting = fcntl.fcntl(descriptor, fcntl.F_SETPIPE_SZ, PIPE_BYTES), array.array("i", [0])

    def is_full() -> bool:
        fcntl.ioctl(descriptor, termios.FIONREAD, waiting)
        assert process.poll() is None
        return waiting[0] >= size // 2

    wait_until(is_full, "output that fills the pipe")


def wait_until_delivered(pid: int, number: signal.Signals) -> None:
    """Wait until a signal is not pending any more: a second one would be merged with it."""
    wait_until(lambda: not _pending(pid) & (1 << (number - 1)), "the delivery of the signal")


def _pending(pid: int) -> int:
    lines = Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines()
    [mask] = (line.split()[1] for line in lines if line.startswith("ShdPnd:"))
    return int(mask, 16)


def end(process: subprocess.Popen[str]) -> str:
    """Send two signals; check that the process ends at once, and return its errors."""
    process.send_signal(signal.SIGINT)
    time.sleep(PAUSE_S)
    process.send_signal(signal.SIGINT)
    sent_s = time.monotonic()
    _, errors = process.communicate(timeout=PATIENCE_S)
    assert time.monotonic() - sent_s < end_limit_s()
    assert "Traceback" not in errors
    return errors


@pytest.mark.usefixtures("talkative")
@pytest.mark.parametrize("words", [("top", "--json"), ("logs", "-f")])
def test_a_command_whose_output_is_not_read(words: tuple[str, ...]) -> None:
    with started(*words) as process:
        wait_until_full(process)
        end(process)


def test_a_dashboard_with_a_client_that_does_not_read() -> None:
    with hand_written("hand_written_camera.py"), started("dashboard", "--port", "0") as process:
        assert process.stdout is not None
        address = Address(process.stdout.readline())
        with raw(address, max_queue=1, close_timeout=0) as client:
            client.subscribe("/camera")
            client.wait(lambda: client.frames)
            end(process)


def test_a_run_with_a_dashboard(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(STUBBORN, encoding="utf-8")
    path.with_name("stubborn.py").write_text(BEHAVIOR, encoding="utf-8")
    with RunningSystem(str(path), "--dashboard", "--grace", "30", program=COMPOSE) as system:
        system.wait_for("1 of 1 nodes active")
        system.wait_for("dashboard: http")
        children = Path(f"/proc/{system.process.pid}/task/{system.process.pid}/children")
        processes = [int(number) for number in children.read_text(encoding="ascii").split()]
        system.process.send_signal(signal.SIGINT)
        system.wait_for("deactivating")
        time.sleep(PAUSE_S)
        _, took_s = system.stop()
        assert took_s < end_limit_s()
        assert "Traceback" not in system.output
        assert not [number for number in processes if Path(f"/proc/{number}").exists()]


@pytest.mark.parametrize(("signals", "grace"), [(1, "0.5"), (2, "600")])
def test_a_regular_expression_that_never_ends(tmp_path: Path, signals: int, grace: str) -> None:
    """It keeps the interpreter's lock, so that no signal handler runs."""
    path = tmp_path / "robot.yaml"
    path.write_text(CATASTROPHE, encoding="utf-8")
    path.with_name("parser.py").write_text(PARSER, encoding="utf-8")
    with RunningSystem(str(path), "--grace", grace) as system:
        wait_until(path.with_name("parsing").exists)  # a line of the log would wait for the lock
        # Its thread may have to wait for the lock once more, before the expression.
        began_s = cpu_s(system.process.pid)
        wait_until(lambda: cpu_s(system.process.pid) > began_s + 0.3, "the expression")
        for _ in range(signals):
            system.process.send_signal(signal.SIGINT)
            wait_until_delivered(system.process.pid, signal.SIGINT)
            time.sleep(PAUSE_S)
        code = system.process.wait(timeout=PATIENCE_S)
    assert code == -signal.SIGABRT
    assert "compose: SIGINT was not handled" in system.output
    assert f'"{path.with_name("parser.py")}", line 8 in on_tick' in system.output
