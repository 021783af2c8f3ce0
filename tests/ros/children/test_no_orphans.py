"""Whatever ends ``compose run``, in whatever phase: no process of the system is left."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path

import pytest

from tests.ros.support.system_process import PATIENCE_S, RunningSystem

PROGRAMS = Path(__file__).parents[1] / "programs"
MARK = "COMPOSER_TEST_SYSTEM"
SYSTEM = """
system: robot
nodes:
  driver:
    executable:
      command: [PYTHON, PROGRAMS/driver.py]
      environment: {VARIABLE: MARK}
    publishers: {words: {type: std_msgs/msg/String, external: true, qos: command}}
  wrapped:
    executable:
      command: [sh, -c, 'PYTHON PROGRAMS/driver.py "$@" & wait', sh]
      environment: {VARIABLE: MARK}
    publishers: {words: {type: std_msgs/msg/String, external: true, qos: command}}
    remappings: {words: other_words}
  camera:
    executable:
      command: [PYTHON, PROGRAMS/managed_driver.py]
      lifecycle: managed
      environment: {VARIABLE: MARK}
    publishers: {words: {type: std_msgs/msg/String, external: true, qos: command}}
    remappings: {words: managed_words}
"""
SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGKILL)
#: Lines of the output after which the signal is sent: in the bring-up, at its end, while it runs.
PHASES = ("/driver inactive", "/wrapped active", "3 of 3 nodes active")


def processes(mark: str) -> list[str]:
    """Return the command lines of the processes with a mark in their environment."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            environment = (folder / "environ").read_bytes()
            command = (folder / "cmdline").read_bytes()
        except OSError:
            continue
        if f"{MARK}={mark}\0".encode() in environment and command:
            found.append(command.replace(b"\0", b" ").decode())
    return found


def end_by(number: signal.Signals, phase: str, path: Path) -> None:
    """Run the system at ``path``, end it in a phase, and wait until no process is left."""
    mark = f"{os.getpid()}-{time.monotonic_ns()}"
    text = SYSTEM.replace("PYTHON", sys.executable).replace("PROGRAMS", str(PROGRAMS))
    path.write_text(text.replace("VARIABLE", MARK).replace("MARK", mark), encoding="utf-8")
    with RunningSystem(str(path)) as system:
        system.wait_for(phase)
        code, _ = system.stop(number)
        # 1 if a node did not answer in time, on a busy machine.
        assert code in ((-9,) if number is signal.SIGKILL else (0, 1))
        end_s = time.monotonic() + PATIENCE_S
        while left := processes(mark):
            assert time.monotonic() < end_s, f"left after {number.name} in '{phase}': {left}"
            time.sleep(0.01)


@pytest.mark.parametrize(("number", "phase"), [*zip(SIGNALS, PHASES[::-1], strict=True)])
def test_no_orphan(number: signal.Signals, phase: str, tmp_path: Path) -> None:
    end_by(number, phase, tmp_path / "robot.yaml")


@pytest.mark.soak
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("number", SIGNALS)
def test_no_orphan_in_fifty_rounds(number: signal.Signals, tmp_path: Path) -> None:
    for round_ in range(50):
        end_by(number, PHASES[round_ % len(PHASES)], tmp_path / "robot.yaml")
