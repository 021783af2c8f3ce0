"""Running systems from another terminal: ps, up, down, pause, resume, reset, lifecycle set."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from composer.runtime.process.instance_lock import local_systems
from tests.ros.support.commands import COMPOSE, PATIENCE_S, asked_until, compose, errors, said
from tests.ros.support.in_process import wait_until

ROBOT = """
system: robot
namespace: fleet
nodes:
  motor: {lifecycle: {depends_on: [planner]}, on_activate: {log: go}}
  planner:
    behavior: planner:Planner
    parameters: {fault: {type: string, default: ""}}
    publishers: {plan: {type: std_msgs/msg/String, qos: command, external: true}}
    timers: {tick: {rate_hz: 20, publish: {plan: {data: "{count} steps"}}}}
  camera: {lifecycle: {autostart: inactive}, on_activate: {log: go}}
"""
PLANNER = """
import time
from composer.behavior import Behavior

class Planner(Behavior):
    def on_configure(self):
        if self.parameters.fault == "configure":
            raise ValueError("no map")

    def on_activate(self):
        if self.parameters.fault == "hang":
            time.sleep(60.0)
"""


def refused(*arguments: object) -> str:
    """Run a command that has to fail and return what it says."""
    done = compose(*arguments)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    return done.stderr


def on_a_terminal(*arguments: str) -> str:
    """Run a command on a terminal of its own and return all that is shown there."""
    ours, theirs = os.openpty()
    shown = b""
    with subprocess.Popen([*COMPOSE, *arguments], stdin=theirs, stdout=theirs, stderr=theirs):
        os.close(theirs)
        with suppress(OSError):  # so Linux tells that the other end is closed
            while part := os.read(ours, 65_536):
                shown += part
    os.close(ours)
    return shown.decode()


@pytest.fixture(autouse=True)
def nothing_stays_running() -> Iterator[None]:
    """End what a failed test left in the background: it would hinder all that come after."""
    yield
    for pid in local_systems().values():
        with suppress(ProcessLookupError, ValueError):
            os.kill(int(pid), signal.SIGKILL)


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "log"))
    file = tmp_path / "robot.yaml"
    file.write_text(ROBOT, encoding="utf-8")
    file.with_name("planner.py").write_text(PLANNER, encoding="utf-8")
    return file


class Robot:
    """The system in the background."""

    def __init__(self, path: Path, *options: object) -> None:
        self.path = path
        self.began_s = time.time()
        self.told = said("run", path, "--wait", "--timeout", 20, *options)
        found = re.search(r"\(process (\d+), log (.*)\)", self.told)
        assert found is not None
        self.pid, self.log = int(found[1]), Path(found[2])

    def states(self) -> dict[str, str]:
        system = json.loads(said("ps", self.path, "--json"))["systems"][0]
        return {node["node"]: node["state"] for node in system["nodes"]}

    def kill(self, number: signal.Signals = signal.SIGKILL) -> None:
        with suppress(ProcessLookupError):
            os.kill(self.pid, number)

    def is_alive(self) -> bool:
        try:
            os.kill(self.pid, 0)
        except ProcessLookupError:
            return False
        return True


@pytest.fixture
def robot(path: Path) -> Iterator[Robot]:
    running = Robot(path)
    yield running
    running.kill()


def planner_in(text: str) -> dict[str, Any]:
    """Return what ``ps --json`` tells of the planner."""
    (system,) = json.loads(text)["systems"]
    found: dict[str, Any] = system["nodes"][0]
    return found


def callback_in(text: str) -> dict[str, Any]:
    """Return the one callback that ``top --once --json`` tells of."""
    (line,) = text.splitlines()
    found: dict[str, Any]
    (found,) = json.loads(line)["callbacks"]
    return found


@pytest.mark.parametrize("options", [(), ("--json",)])
def test_one_look_at_callbacks_stays_on_the_terminal(
    robot: Robot, options: tuple[str, ...]
) -> None:
    shown = on_a_terminal("top", "--once", *options)
    assert "/fleet/planner" in shown
    assert "\x1b" not in shown


def test_a_system_runs_in_the_background_until_it_is_ended(robot: Robot) -> None:
    assert robot.told.startswith("2 of 3 nodes active after")
    text = said("ps")
    line, head, *rows = text.splitlines()
    assert line.startswith("/fleet/robot: running, 2 of 3 nodes active (host ")
    assert f"process {robot.pid})" in line
    assert head.split()[:4] == ["node", "state", "since", "restarts"]
    assert [row.split()[:2] for row in rows] == [
        ["/fleet/planner", "active"],
        ["/fleet/motor", "active"],
        ["/fleet/camera", "inactive"],
    ]
    # A system that gets no processor for a moment sends less in that second.
    text = asked_until(
        lambda text: planner_in(text)["sent_hz"] == pytest.approx(20.0, abs=3.0), "ps", "--json"
    )
    planner = planner_in(text)
    assert planner["sent_hz"] == pytest.approx(20.0, abs=3.0)
    assert planner["slowest"].startswith("timer 'tick' ")
    (tick,) = planner["callbacks"]
    assert (tick["kind"], tick["name"]) == ("timer", "tick")
    assert 0.0 < tick["mean_ms"] <= tick["longest_ms"]
    assert tick["late_longest_ms"] > 0.0

    text = asked_until(
        lambda text: callback_in(text)["calls_hz"] == pytest.approx(20.0, abs=5.0),
        *("top", "--once", "--json"),
    )
    callback = callback_in(text)
    assert callback["node"] == "/fleet/planner"
    assert callback["calls_hz"] == pytest.approx(20.0, abs=5.0)
    assert 0.0 < callback["busy"] < 1.0
    assert callback["count"] > tick["count"]
    assert robot.began_s <= planner["since_s"] <= time.time()

    refusal = refused("run", robot.path)
    assert f"process {robot.pid}" in refusal
    assert "system '/fleet/robot' already runs in ROS domain" in refusal
    assert "end it with 'compose down /fleet/robot'" in refusal

    assert said("down", "robot").startswith("/fleet/robot: the system has stopped")
    # It gives its name back, which 'down' waits for, and then sums up.
    summary = re.compile(r"ran for .*\n/fleet/planner +timer 'tick' +\d+", re.DOTALL)
    wait_until(lambda: summary.search(robot.log.read_text()), "the summary")
    refusal = refused("down", robot.path)
    assert refusal.startswith("compose: there is no running system 'robot'")
    assert "no system is running: start one with 'compose run'" in refusal


def test_commands_to_a_whole_system(robot: Robot) -> None:
    assert said("pause", "robot") == "/fleet/robot: 0 of 3 nodes active\n"
    assert robot.states() == dict.fromkeys(robot.states(), "inactive")
    assert said("resume", "/fleet/robot") == "/fleet/robot: 2 of 3 nodes active\n"
    assert said("reset", robot.path) == "/fleet/robot: 0 of 3 nodes active\n"
    assert robot.states() == dict.fromkeys(robot.states(), "unconfigured")

    said("param", "set", "/fleet/planner", "fault", "configure")
    refusal = refused("up", "robot")
    assert refusal.startswith(
        "compose: /fleet/robot did not come up: /fleet/planner: configure failed: "
        "ValueError: no map; rolled back"
    )
    assert robot.states() == dict.fromkeys(robot.states(), "unconfigured")
    said("param", "set", "/fleet/planner", "fault", "none")
    assert said("up", "robot") == "/fleet/robot: 2 of 3 nodes active\n"
    assert refused("up", "rowbot").splitlines()[1] == "  did you mean '/fleet/robot'?"


def test_several_nodes_patterns_and_systems_are_moved_at_once(robot: Robot) -> None:
    moved = said("lifecycle", "set", "motor", "planner", "deactivate")
    assert moved == "/fleet/motor: active -> inactive\n/fleet/planner: active -> inactive\n"
    moved = said("lifecycle", "set", "/fleet/[mp]*", "--to", "active")
    assert moved == "/fleet/motor: inactive -> active\n/fleet/planner: inactive -> active\n"
    moved = said("lifecycle", "set", "--system", "robot", "--to", "unconfigured")
    assert moved.splitlines() == [
        "/fleet/camera: inactive -> unconfigured",
        "/fleet/motor: active -> unconfigured",
        "/fleet/planner: active -> unconfigured",
    ]
    moved = said("lifecycle", "set", "--system", "robot", "configure")
    assert [line.partition(":")[0] for line in moved.splitlines()] == [
        "/fleet/planner",
        "/fleet/motor",
        "/fleet/camera",
    ]
    done = compose("lifecycle", "set", "camera", "planner", "cleanup")
    assert done.returncode == 0
    done = compose("lifecycle", "set", "camera", "motor", "cleanup")
    assert (done.returncode, done.stdout) == (1, "/fleet/motor: inactive -> unconfigured\n")
    assert "'cleanup' is not possible: /fleet/camera is unconfigured" in done.stderr
    assert "possible now: configure, shutdown" in done.stderr
    assert "there is no lifecycle node like 'x*'" in refused("lifecycle", "set", "x*", "cleanup")
    said("lifecycle", "set", "camera", "--to", "finalized")
    refusal = refused("lifecycle", "set", "camera", "--to", "active")
    assert "there is no way to 'active': /fleet/camera is finalized" in refusal
    for arguments in (["motor"], ["--to", "active"], ["--system", "robot", "motor", "activate"]):
        assert compose("lifecycle", "set", *arguments).returncode in (1, 2)


def test_what_does_not_answer_is_said_to_be_so_in_time(robot: Robot) -> None:
    said("lifecycle", "set", "planner", "deactivate")
    said("param", "set", "/fleet/planner", "fault", "hang")
    refusal = refused("lifecycle", "set", "planner", "activate", "--timeout", 5)
    assert "/fleet/planner did not answer within 5 s" in refusal
    began_s = time.monotonic()
    assert robot.states()["/fleet/planner"] == "activating"
    assert time.monotonic() - began_s < 15.0

    robot.kill(signal.SIGSTOP)
    try:
        refusal = refused("pause", "robot", "--timeout", 1.5)
        assert f"its process is {robot.pid}" in refusal
        began_s = time.monotonic()
        assert "no answer, its process may be busy or gone" in said("ps")
        assert time.monotonic() - began_s < 15.0
    finally:
        robot.kill(signal.SIGCONT)


def test_a_system_that_was_killed_is_said_not_to_run(robot: Robot) -> None:
    robot.kill()
    wait_until(lambda: not local_systems(), "its end")
    began_s = time.monotonic()
    assert said("ps") == "nothing is running\n"
    assert said("lifecycle", "nodes") == ""
    commands = ("ps", "up", "down", "pause", "resume", "reset")
    for told in errors(*((command, "robot") for command in commands)):
        assert "there is no running system 'robot'" in told
    by_path, misspelt, by_name, in_a_system, asked = errors(
        ("ps", robot.path),
        ("ps", robot.path.with_name("robt.yaml")),
        ("lifecycle", "set", "planner", "deactivate"),
        ("lifecycle", "set", "--system", "robot", "cleanup"),
        ("lifecycle", "get", "/fleet/planner"),
    )
    assert "no system is running: start one with" in by_path
    assert "did you mean" in misspelt
    assert "there is no running system" in in_a_system
    for told in (by_name, asked):
        assert "there is no lifecycle node " in told
    assert time.monotonic() - began_s < 11 * 5.0


def test_a_command_does_not_wait_for_a_process_that_has_ended(robot: Robot) -> None:
    said("param", "set", "/fleet/planner", "fault", "hang")
    said("pause", "robot")
    limit_s = 25.0
    with subprocess.Popen(
        [*COMPOSE, "resume", "robot", "--timeout", str(limit_s)], stderr=subprocess.PIPE, text=True
    ) as resuming:
        assert resuming.stderr is not None
        wait_until(lambda: robot.states()["/fleet/planner"] == "activating", "it hangs")
        robot.kill()
        began_s = time.monotonic()
        refusal = resuming.stderr.read()
        assert time.monotonic() - began_s < limit_s / 3
    assert resuming.returncode == 1
    assert "/fleet/robot did not resume: its process has ended" in refusal


def test_a_list_that_lacks_the_nodes_of_a_system_says_so(robot: Robot) -> None:
    robot.kill(signal.SIGSTOP)
    asking = (("nodes",), ("get", "planner"), ("set", "/fleet/*", "cleanup"))
    for refusal in errors(*(("lifecycle", *arguments) for arguments in asking)):
        assert "system '/fleet/robot' does not answer, so its nodes are not known" in refusal
        assert f"its process {robot.pid} may be busy or stopped" in refusal


def test_a_system_that_does_not_come_up_is_no_background_process(path: Path) -> None:
    refusal = refused("run", path, "--wait", "--set", "planner.fault=configure")
    assert "the system did not come up (exit code 1):" in refusal
    assert "/fleet/planner failed" in refusal
    # Up to where it hangs a start takes longer on a busy machine.
    refusal = refused("run", path, "--timeout", 5, "--set", "planner.fault=hang", "--grace", 3)
    assert "activate failed: bring-up timed out after 5 s" in refusal


def test_of_two_hosts_the_second_one_yields(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two hosts share no lock files; neither do two processes with runtime folders of their own."""
    first_folder, second_folder = path.parent / "first", path.parent / "second"
    for folder in (first_folder, second_folder):
        folder.mkdir()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(first_folder))
    first = Robot(path)
    try:
        monkeypatch.setenv("XDG_RUNTIME_DIR", str(second_folder))
        refusal = refused("run", path, "--for", PATIENCE_S)
        assert "stopping: system '/fleet/robot' already runs in ROS domain" in refusal
        assert f"process {first.pid}" in refusal
        assert first.is_alive()
        assert first.states()["/fleet/motor"] == "active"
    finally:
        first.kill()
