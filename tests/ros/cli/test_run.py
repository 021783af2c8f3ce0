"""``compose run`` and ``compose lifecycle`` in separate processes."""

from __future__ import annotations

import fcntl
import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from textwrap import dedent

import pytest
from std_msgs.msg import Int64

from tests.cli.compose import compose as in_process
from tests.ros.support.commands import COMPOSE, PATIENCE_S, compose, listed, running, start
from tests.ros.support.in_process import Peer, wait_until


def states_in(text: str) -> list[str]:
    """Return the state changes in the log, as 'node state'."""
    lines = [line.rpartition("[compose] ")[2] for line in text.splitlines() if "[compose]" in line]
    return [line for line in lines if line.startswith("/") and len(line.split()) == 2]


def without_errors_of_dds(text: str) -> list[str]:
    """Return the lines that Fast DDS has not printed; it does when a participant ends."""
    return [
        line for line in text.splitlines() if "[RTPS_" not in re.sub(r"\x1b\[[\d;]*m", "", line)
    ]


def test_a_system_comes_up_in_order_stops_and_prints_a_summary() -> None:
    for seconds in (2, 5, 10):  # a process that is not scheduled for a moment sends less
        done = compose("run", "systems/pipeline.yaml", "--for", seconds)
        if sent_by_the_first_node(done.stderr) > 5:
            break
    assert (done.returncode, without_errors_of_dds(done.stdout)) == (0, [])
    shown = states_in(done.stderr)
    assert shown[3:6] == [
        "/perception/sensor_simulator active",
        "/planning/planner active",
        "/control/motor_controller active",
    ]
    assert shown[6] == "/control/motor_controller inactive"
    assert "3 of 3 nodes active" in done.stderr
    row = first_row_of_the_summary(done.stderr)
    assert row[:2] == ["/perception/sensor_simulator", "finalized"]
    assert sent_by_the_first_node(done.stderr) > 5  # of 60, on a busy machine


def first_row_of_the_summary(text: str) -> list[str]:
    rows = [line.split() for line in text.splitlines()]
    head = rows.index(["node", "state", "received", "sent", "requests", "dropped", "errors"])
    return rows[head + 1]


def sent_by_the_first_node(text: str) -> int:
    return int(first_row_of_the_summary(text)[3])


def test_simulated_time_can_be_enabled_and_disabled(tmp_path: Path) -> None:
    with running(
        tmp_path / "stderr.txt", "talker_listener", "--use-sim-time", "--for", "60"
    ) as run:
        run.wait_for("2 of 2 nodes active")
        assert listed(("\n",), "param", "get", "/talker", "use_sim_time") == "true\n"
        assert "Received" not in run.log.read_text()  # there is no /clock
        assert listed(("false",), "param", "set", "/talker", "use_sim_time", "false")
        run.wait_for("Received: Sensor reading 0")


FAILING = """
system: failing
nodes:
  good: {}
  bad: {behavior: failing:Bad}
"""
FAILING_MODULE = """
class Bad:
    def on_activate(self):
        raise RuntimeError("no milk")

class Ticking:
    def on_tick(self):
        raise ValueError("no map")

class Worse(Ticking):
    on_tock = Ticking.on_tick
"""


@pytest.fixture
def failing(tmp_path: Path) -> Path:
    """A system with a node that does not come up."""
    path = tmp_path / "failing.yaml"
    path.write_text(FAILING, encoding="utf-8")
    path.with_suffix(".py").write_text(FAILING_MODULE, encoding="utf-8")
    return path


def test_a_node_that_fails_ends_the_run_with_exit_code_1(failing: Path) -> None:
    done = compose("run", failing, "--for", "0.2")
    assert done.returncode == 1
    assert "no milk" in done.stderr
    failure = "/bad is isolated: activate failed: RuntimeError: no milk"
    assert re.search(
        r"\[WARN\].* 1 of 2 nodes active after \S+ s, /bad is isolated$", done.stderr, re.MULTILINE
    )
    assert f"\nnot up at the end: {failure}\n" in done.stderr
    together = compose("run", failing, "--all-or-nothing")
    assert together.returncode == 1
    assert "rolling back because of /bad" in together.stderr
    assert states_in(together.stderr)[-1].endswith("finalized")


def test_a_background_run_that_is_not_complete_has_exit_code_1(tmp_path: Path) -> None:
    (tmp_path / "part.yaml").write_text(
        "system: part\nnodes:\n  good: {}\n  bad: {executable: {command: [sh, -c, exit 3]}}\n"
    )
    done = compose("run", tmp_path / "part.yaml", "--wait")
    try:
        assert done.returncode == 1
        assert "compose: 1 of 2 nodes active after " in done.stderr
        assert "/bad is isolated: activate failed: its process exited with status 3" in done.stderr
        assert "end them with 'compose down', or use --all-or-nothing" in done.stderr
        shown = compose("ps", "part").stdout
        assert re.search(r"^/bad +unconfigured \(isolated\)", shown, re.MULTILINE)
    finally:
        compose("down", "part")


def test_errors_are_in_the_summary_and_may_fail_the_run(failing: Path) -> None:
    ticking = FAILING.replace(":Bad}", ":Ticking, timers: {tick: {period_ms: 10}}}")
    worse = "  worse:\n    behavior: failing:Worse\n    timers: {tick: {period_ms: 10}, "
    failing.write_text(f"{ticking}{worse}tock: {{period_ms: 10}}}}\n", encoding="utf-8")
    summary = re.compile(r"^\d+ errors in nodes /worse \(\d+\), /bad \(\d+\)$", re.MULTILINE)
    for options, code in (((), 0), (("--fail-on-error",), 1)):
        for seconds in (0.4, 3, 10):  # a process may not be scheduled for a moment
            done = compose("run", failing, "--for", seconds, *options)
            if summary.search(done.stderr):
                break
        assert done.returncode == code
        assert summary.search(done.stderr)


def test_run_in_the_background_gets_the_same_options(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[str] = []

    def start(_: str, arguments: list[str], limit_s: float) -> str:
        given.extend(arguments)
        return f"started within {limit_s} s"

    monkeypatch.setattr("composer.cli.support.process.run_in_background", start)
    options = ("--fail-on-error", "--check-mutation", "--no-tracing", "--use-sim-time")
    options += ("--await-processes",)
    assert in_process("run", "systems/pipeline.yaml", "--wait", *options).code == 0
    assert set(options) < set(given)


GRIP = "{type: arm_interfaces/msg/Grip, qos: command, external: true}"
USED = f"{{subscriptions: {{grip: {GRIP}}}}}"
#: A module that a class imports in vain, none for a message of a port, and the hint.
MISSING = (
    ("", "colcon build --packages-select arm_interfaces"),
    ("interactive_markers", "pip install interactive_markers   or, if it is a package of ROS: apt"),
    ("can", "pip install python-can\n"),
    ("geographic_msgs.msg", "compose interface build geographic_msgs   or: apt install ros-"),
    ("arm_interfaces.msg", "compose interface build arm_interfaces   or: colcon build"),
)


def test_missing_packages_are_reported_before_the_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "interfaces" / "arm_interfaces"
    (package / "msg").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>arm_interfaces</name></package>")
    (package / "msg" / "Grip.msg").write_text("float64 force\n")
    (tmp_path / "composer.yaml").write_text("interfaces: [interfaces]\n")
    (tmp_path / "arm_interfaces").mkdir()  # as in the source of a package with code as well
    (tmp_path / "arm_interfaces" / "__init__.py").touch()
    for number, (module, hint) in enumerate(MISSING):
        (tmp_path / f"marker_{number}.py").write_text(
            f"import {module or 'sys'}\nfrom rclpy.node import Node\nclass Marker(Node): ...\n"
        )
        node = f'{{class: "marker_{number}:Marker"}}' if module else USED
        (tmp_path / "arm.yaml").write_text(f"system: arm\nnodes: {{arm: {node}}}\n")
        if module:  # sources are searched for in the current folder
            monkeypatch.chdir(tmp_path)
        done = compose("run", tmp_path / "arm.yaml")
        assert done.returncode == 78
        user = f"'marker_{number}:Marker' of node 'arm' imports '{module.partition('.')[0]}"
        user = user if module else "'arm_interfaces' of node 'arm' is not"
        assert user in done.stderr
        assert "is not installed for this Python\n" in done.stderr
        assert f"\n  {hint}" in done.stderr
        assert "Traceback" not in done.stderr


def test_an_empty_graph_is_explained_in_time(monkeypatch: pytest.MonkeyPatch) -> None:
    for command, kind in (
        ("node list", "node"),
        ("topic list", "topic"),
        ("lifecycle nodes", "lifecycle node"),
    ):
        done = compose(*command.split())
        assert (done.returncode, done.stdout) == (0, "")
        assert f"no {kind} found: " in done.stderr
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF")
    done = compose("lifecycle", "get", "planner", "--timeout", "1")
    assert done.returncode == 1
    assert "no lifecycle node was found: " in done.stderr


def test_ctrl_c_ends_a_waiting_command_without_a_traceback(peer: Peer) -> None:
    process = start("topic", "pub", "/unheard", "std_msgs/msg/Empty", "--once", "--timeout", "60")
    # It prints nothing until it ends; it waits once its publisher is discovered.
    wait_until(lambda: peer.node.count_publishers("/unheard"), "the command")
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, out) == (130, "")
    assert "Traceback" not in err


LOADING = """
import sys
import time

class Slow:
    def find_spec(self, name, path=None, target=None):
        if name.startswith("rclpy."):
            print("loading", flush=True)
            time.sleep(60)  # until it is interrupted

sys.meta_path.insert(0, Slow())
from composer.cli import main
sys.exit(main(["run", "systems/pipeline.yaml"]))
"""


def test_ctrl_c_ends_a_run_that_is_still_loading_ros() -> None:
    command = [sys.executable, "-c", LOADING]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "loading\n"
        process.send_signal(signal.SIGINT)
        _, error = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, error) == (-signal.SIGINT, "")


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
