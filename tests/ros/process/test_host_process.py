"""A running system as a process: signals, exit codes, the environment, leftovers, libraries."""

from __future__ import annotations

import os
import random
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from composer.runtime.middleware.local_resources import SHARED_MEMORY
from composer.runtime.process.instance_lock import socket_path
from tests.ros.process.test_restarts import children
from tests.ros.support.commands import COMPOSE
from tests.ros.support.in_process import end_limit_s
from tests.ros.support.system_process import PATIENCE_S, RunningSystem, write_system

PIPELINE = "systems/pipeline.yaml"
#: The order of the tear-down.
ORDER = ("/control/motor_controller", "/planning/planner", "/perception/sensor_simulator")


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


@pytest.mark.parametrize(("program", "repeat_signal"), [((), False), (COMPOSE, True)])
def test_a_process_with_a_hanging_callback_ends_in_time(
    tmp_path: Path, program: tuple[str, ...], *, repeat_signal: bool
) -> None:
    path = write_system(tmp_path, HANGING, hanging=HANGING_MODULE)
    with RunningSystem(str(path), program=program) as run:
        run.wait_for(r"\[hanging\] hanging")
        run.process.send_signal(signal.SIGINT)
        run.wait_for("shutting down: SIGINT")
        began_s = time.monotonic()
        while repeat_signal and time.monotonic() < began_s + PATIENCE_S:
            with suppress(subprocess.TimeoutExpired):
                run.process.wait(0.15)
                break
            run.process.send_signal(signal.SIGINT)
        assert run.wait() == 1
        assert time.monotonic() - began_s < end_limit_s()
    assert "/hanging is stuck and did not deactivate in" in run.output
    assert "on_tick" in run.output


def test_an_invalid_environment_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "-1")
    with RunningSystem("systems/minimal.yaml", "--for", "1") as run:
        assert run.wait() == 1
    assert "ROS_DOMAIN_ID is '-1', which is not a domain id" in run.output
    assert "Traceback" not in run.output
    assert "internal error" not in run.output


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


def test_incomplete_shared_memory_of_a_killed_process_does_not_hang_a_system(
    ros_domain_id: int,
) -> None:
    left = tuple(incomplete_ports(ros_domain_id))
    try:
        with RunningSystem(PIPELINE, "--for", "0.1") as run:
            assert run.wait() == 0
        # Whether one that remains hangs a participant depends on which ports it opens.
        assert not [port for port in left if port.exists()]
    finally:
        for port in left:
            port.unlink(missing_ok=True)


LOUD = """
system: loud
nodes:
  loud:
    namespace: robot
    behavior: loud:Loud
    on_configure: {log: {level: debug, message: "a debug line"}}
    on_activate: {log: {level: warn, message: "a warning"}}
"""
LOUD_MODULE = """
import sys

class Loud:
    def on_activate(self):
        self.log.info(f"threads take turns after {sys.getswitchinterval():g} s")
"""


def test_node_logs_reach_the_terminal_at_their_level_and_threads_take_turns_soon(
    tmp_path: Path,
) -> None:
    path = write_system(tmp_path, LOUD, loud=LOUD_MODULE)
    with RunningSystem(str(path), "--for", "0.1", "--log-level", "debug") as run:
        assert run.wait() == 0
    assert "] [WARN] [robot.loud] a warning\n" in run.output
    assert "] [DEBUG] [robot.loud] a debug line\n" in run.output
    assert "] threads take turns after 0.001 s\n" in run.output


LOAD = """
import sys
from composer.runtime.process.libraries import loading_libraries
with loading_libraries():
    pass
assert "rclpy" not in sys.modules
with open("/proc/self/maps") as maps:
    print("librcl.so" in maps.read())
"""
TYPE_SUPPORT = """
import sys
from composer.runtime.ros.messages import interface_class
interface_class("std_msgs/msg/String")
print("lark" in sys.modules, "rosidl_generator_py" in sys.modules)
import rosidl_generator_py.generate_py_impl
"""


@pytest.mark.parametrize(
    ("program", "middleware", "printed"),
    [
        pytest.param(LOAD, "", "True", id="libraries are loaded before rclpy is imported"),
        pytest.param(LOAD, "rmw_nothing", "False", id="nothing that may end the process"),
        pytest.param(TYPE_SUPPORT, "", "False True", id="not the generator of message classes"),
    ],
)
def test_what_a_process_loads_of_ros(
    program: str, middleware: str, printed: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RMW_IMPLEMENTATION", middleware)
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, timeout=60, check=True)
    assert done.stdout.strip() == printed


#: The lines that start each part of the pipeline's life.
MOMENTS = ("inactive$", "sensor_simulator active$", "3 of 3 nodes active")


def end_at(
    moment: str,
    delay_s: float,
    number: signal.Signals,
    times: int = 1,
    program: tuple[str, ...] = (),
) -> float:
    """Run the pipeline, send a signal ``delay_s`` after a moment of its life.

    Check that the end is in time and in order and leaves no processes; return how long it took.
    """
    with RunningSystem(PIPELINE, "--for", "30", program=program) as system:
        system.wait_for(moment)
        time.sleep(delay_s)
        _, *left = children(system.process.pid)
        sent_s = time.monotonic()
        for _ in range(times):
            os.kill(system.process.pid, number)
        code = system.process.wait(timeout=60.0)
        took_s = time.monotonic() - sent_s
    case = f"{number.name} {1000.0 * delay_s:.0f} ms after '{moment}'\n{system.output}"
    assert code == 0, case
    assert took_s < end_limit_s(), case
    assert f"shutting down: {number.name}" in system.output, case
    assert "Traceback" not in system.output, case
    assert "stuck" not in system.output, case
    for state in ("inactive", "unconfigured", "finalized"):
        check_order(system.lines, state, case)
    assert not [pid for pid in left if Path("/proc", str(pid)).exists()], case
    path = socket_path("/pipeline")
    assert path is not None
    assert not path.exists()
    return took_s


def check_order(lines: list[str], state: str, case: str) -> None:
    """Check that the tear-down follows the order of the dependencies."""
    stopping = next(place for place, line in enumerate(lines) if "shutting down:" in line)
    down = [
        found[1] for line in lines[stopping:] if (found := re.search(rf"\] (/\S+) {state}$", line))
    ]
    assert down == [node for node in ORDER if node in down], case
    if state == "finalized":
        assert len(down) == len(ORDER), case


@pytest.mark.parametrize(
    "times",
    [1, pytest.param(17, marks=[pytest.mark.soak, pytest.mark.timeout(1800)])],
)
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_at_a_random_moment_ends_everything(number: signal.Signals, times: int) -> None:
    seed = random.randrange(2**32)
    chance = random.Random(seed)
    moments = chance.sample(MOMENTS, 2) if times == 1 else MOMENTS * times
    took_s = [end_at(moment, chance.uniform(0.0, 0.4), number) for moment in moments]
    print(f"{number.name}: {len(took_s)} ends, seed {seed}, longest {max(took_s):.2f} s")


@pytest.mark.parametrize(
    ("number", "times", "program"),
    [(signal.SIGQUIT, 1, ()), (signal.SIGHUP, 1, ()), (signal.SIGINT, 2, COMPOSE)],
)
def test_a_signal_ends_the_pipeline_in_order(
    number: signal.Signals, times: int, program: tuple[str, ...]
) -> None:
    """The same one twice counts once, as forwarded by make, timeout or a launcher."""
    end_at(MOMENTS[-1], 0.0, number, times, program)
