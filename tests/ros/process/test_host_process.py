"""A running system as a process: signals, exit codes, the environment, leftovers."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from textwrap import dedent

import pytest

from composer.base.resources import systems_folder
from composer.runtime.middleware.shared_memory import SHARED_MEMORY
from composer.runtime.process.instance_lock import socket_path
from tests.ros.support.commands import COMPOSE
from tests.ros.support.in_process import end_limit_s

PATIENCE_S = 50.0


class Running:
    """A ``compose run`` in a process of its own, with its output in a file."""

    def __init__(self, process: subprocess.Popen[bytes], output: Path) -> None:
        self.process = process
        self._output = output

    def text(self) -> str:
        return self._output.read_text(encoding="utf-8")

    def wait_for(self, part: str) -> None:
        until_s = time.monotonic() + PATIENCE_S
        while True:
            has_ended = self.process.poll() is not None  # then the output is complete
            if part in self.text():
                return
            assert not has_ended, f"ended: {self.text()}"
            assert time.monotonic() < until_s, f"no '{part}' in {self.text()}"
            time.sleep(0.002)

    def end(self, *, repeat_signal: bool = False) -> tuple[int, float]:
        """Wait for the end, maybe with repeated Ctrl-C; return the exit code and the duration."""
        began_s = time.monotonic()
        while repeat_signal and time.monotonic() < began_s + PATIENCE_S:
            with suppress(subprocess.TimeoutExpired):
                self.process.wait(0.15)
                break
            self.process.send_signal(signal.SIGINT)
        try:
            code = self.process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.send_signal(signal.SIGABRT)  # prints the stacks of all threads
            self.process.wait()
            raise AssertionError(f"does not end: {self.text()}") from None
        return code, time.monotonic() - began_s


@contextmanager
def compose_run(folder: Path, *arguments: object, **environment: str) -> Iterator[Running]:
    path = folder / "output.txt"
    with path.open("wb") as output:
        process = subprocess.Popen(
            [*COMPOSE, "run", *map(str, arguments)],
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            env={**os.environ, "PYTHONFAULTHANDLER": "1", **environment},
        )
    try:
        yield Running(process, path)
    finally:
        process.kill()
        process.wait()


def pipeline() -> Path:
    return systems_folder() / "pipeline.yaml"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGQUIT, signal.SIGHUP])
def test_a_signal_ends_the_pipeline_in_order(tmp_path: Path, number: signal.Signals) -> None:
    with compose_run(tmp_path, pipeline()) as run:
        run.wait_for("3 of 3 nodes active")
        run.process.send_signal(number)
        code, took_s = run.end()
    text = run.text()
    assert code == 0, text
    assert took_s < end_limit_s()
    assert f"shutting down: {number.name}" in text
    assert "Traceback" not in text
    path = socket_path("/pipeline")
    assert path is not None
    assert not path.exists()
    order = [
        "/control/motor_controller finalized",
        "/planning/planner finalized",
        "/perception/sensor_simulator finalized",
    ]
    places = [text.index(line) for line in order]
    assert places == sorted(places)


HANGING = """
system: hanging
nodes:
  hanging: {behavior: "hanging:Hanging", timers: {tick: {period_ms: 10}}}
"""
HANGING_MODULE = """
from time import sleep
from composer.behavior import Behavior

class Hanging(Behavior):
    def on_tick(self):
        self.log.info("hanging")
        while True:
            sleep(0.1)
"""


@pytest.mark.parametrize("repeat_signal", [False, True])
def test_a_process_with_a_hanging_callback_ends_in_time(
    tmp_path: Path, *, repeat_signal: bool
) -> None:
    path = tmp_path / "hanging.yaml"
    path.write_text(HANGING, encoding="utf-8")
    path.with_suffix(".py").write_text(HANGING_MODULE, encoding="utf-8")
    with compose_run(tmp_path, path) as run:
        run.wait_for("[hanging] hanging")
        run.process.send_signal(signal.SIGINT)
        run.wait_for("shutting down: SIGINT")
        code, took_s = run.end(repeat_signal=repeat_signal)
    assert code == 1, run.text()
    assert took_s < end_limit_s()
    assert "/hanging is stuck and did not deactivate in" in run.text()
    assert "on_tick" in run.text()


@pytest.mark.parametrize(
    ("variables", "words"),
    [
        ({"ROS_DOMAIN_ID": "-1"}, "ROS_DOMAIN_ID is '-1', which is not a domain id"),
        (
            {
                "ROS_SECURITY_ENABLE": "true",
                "ROS_SECURITY_KEYSTORE": "keys",
                "ROS_SECURITY_STRATEGY": "Enforce",
            },
            "ROS does not start",
        ),
        ({"RMW_IMPLEMENTATION": "rmw_nonsense"}, "installed: rmw_fastrtps_cpp"),
    ],
)
def test_an_invalid_environment_is_refused(
    tmp_path: Path, variables: dict[str, str], words: str
) -> None:
    system = systems_folder() / "minimal.yaml"
    with compose_run(tmp_path, system, "--for", 1, **variables) as run:
        code, _ = run.end()
    assert code == 1, run.text()
    assert words in run.text()
    assert "Traceback" not in run.text()
    assert "internal error" not in run.text()


def incomplete_ports(domain_id: int) -> Iterator[Path]:
    """Create what remains of a process that is killed while it creates a port in shared memory.

    The numbers: DDS Interoperability Protocol, 9.6.1.1, metatraffic and user data by unicast.
    """
    for offset in range(10, 40):
        port = SHARED_MEMORY / f"fastrtps_port{7400 + 250 * domain_id + offset}"
        if not port.exists():
            port.touch()
            os.utime(port, (0, 0))
            yield port


def test_the_same_signal_twice_at_once_counts_once(tmp_path: Path) -> None:
    with compose_run(tmp_path, pipeline()) as run:
        run.wait_for("3 of 3 nodes active")
        run.process.send_signal(signal.SIGINT)
        run.process.send_signal(signal.SIGINT)  # as forwarded by make, timeout or a launcher
        code, _ = run.end()
    assert code == 0, run.text()
    assert "stuck" not in run.text()


def test_incomplete_shared_memory_of_a_killed_process_does_not_hang_a_system(
    tmp_path: Path, ros_domain_id: int
) -> None:
    left = tuple(incomplete_ports(ros_domain_id))
    try:
        with compose_run(tmp_path, pipeline(), "--for", 0.1) as run:
            code, _ = run.end()
        assert code == 0, run.text()
        # Whether one that remains hangs a participant depends on which ports it opens.
        assert not [port for port in left if port.exists()]
    finally:
        for port in left:
            port.unlink(missing_ok=True)


def test_node_logs_reach_the_terminal_at_their_level(tmp_path: Path) -> None:
    path = tmp_path / "loud.yaml"
    path.write_text(
        dedent(
            """
            system: loud
            nodes:
              loud:
                namespace: robot
                on_configure: {log: {level: debug, message: "a debug line"}}
                on_activate: {log: {level: warn, message: "a warning"}}
            """
        ),
        encoding="utf-8",
    )
    with compose_run(tmp_path, path, "--for", 0.1, "--log-level", "info") as run:
        assert run.end()[0] == 0
    assert "] [WARN] [robot.loud] a warning\n" in run.text()
    assert "a debug line" not in run.text()
    with compose_run(tmp_path, path, "--for", 0.1, "--log-level", "debug") as run:
        assert run.end()[0] == 0
    assert "] [DEBUG] [robot.loud] a debug line\n" in run.text()


def test_threads_take_turns_soon(tmp_path: Path) -> None:
    path = tmp_path / "turns.yaml"
    path.write_text("system: turns\nnodes: {turner: {behavior: 'turner:Turner'}}\n", "utf-8")
    tmp_path.joinpath("turner.py").write_text(
        dedent(
            """
            import sys

            class Turner:
                def on_activate(self):
                    self.log.info(f"interval {sys.getswitchinterval():g}")
            """
        ),
        encoding="utf-8",
    )
    with compose_run(tmp_path, path, "--for", 0.1) as run:
        assert run.end()[0] == 0
    assert "] interval 0.001\n" in run.text()
