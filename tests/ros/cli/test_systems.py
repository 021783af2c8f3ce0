"""Commands to running systems: ps, down, top, lifecycle."""

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
from tests.ros.support.background import PLANNER, ROBOT, Robot, lifecycle_set, moved, set_fault
from tests.ros.support.commands import (
    COMPOSE,
    compose,
    errors,
    expect_error,
    expect_errors,
    listed,
    output_of,
    repeated_until,
    start,
)
from tests.ros.support.in_process import wait_until


def refused(*arguments: object) -> str:
    """Run a command that must fail; return its stderr."""
    done = compose(*arguments)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "composer/runtime" not in done.stderr  # no traceback, except one of user code
    return done.stderr


def on_a_terminal(*arguments: str) -> str:
    """Run a command in a new terminal; return its output."""
    ours, theirs = os.openpty()
    shown = b""
    with subprocess.Popen([*COMPOSE, *arguments], stdin=theirs, stdout=theirs, stderr=theirs):
        os.close(theirs)
        with suppress(OSError):  # raised by Linux when the other side is closed
            while part := os.read(ours, 65_536):
                shown += part
    os.close(ours)
    return shown.decode()


@pytest.fixture(autouse=True)
def nothing_stays_running() -> Iterator[None]:
    """End the systems that a failed test left in the background."""
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


@pytest.fixture
def robot(path: Path) -> Iterator[Robot]:
    running = Robot(path)
    yield running
    running.kill()


def planner_in(text: str) -> dict[str, Any]:
    """Return the planner from the output of ``ps --json``, empty without a response."""
    (system,) = json.loads(text)["systems"]
    found: dict[str, Any] = system.get("nodes", [{}])[0]
    return found


def callback_in(text: str) -> dict[str, Any]:
    """Return the only callback from the output of ``top --once --json``, empty if there is none."""
    (line,) = text.splitlines()
    found: dict[str, Any]
    (found,) = json.loads(line)["callbacks"] or [{}]
    return found


def test_a_system_runs_in_the_background_until_down(robot: Robot) -> None:
    assert robot.text.startswith("2 of 3 nodes active after")
    text = listed(("/fleet/camera",), "ps")
    line, head, *rows = text.splitlines()
    assert line.startswith("/fleet/robot: running, 2 of 3 nodes active (host ")
    assert f"process {robot.pid})" in line
    assert head.split()[:4] == ["node", "state", "since", "restarts"]
    assert [row.split()[:2] for row in rows] == [
        ["/fleet/planner", "active"],
        ["/fleet/motor", "active"],
        ["/fleet/camera", "inactive"],
    ]
    # A system that is not scheduled for a moment sends fewer messages in that second.
    text = repeated_until(
        lambda text: planner_in(text).get("sent_hz") == pytest.approx(20.0, abs=3.0),
        *("ps", "--json"),
    )
    planner = planner_in(text)
    assert planner["sent_hz"] == pytest.approx(20.0, abs=3.0)
    assert planner["slowest"].startswith("timer 'tick' ")
    (tick,) = planner["callbacks"]
    assert (tick["kind"], tick["name"]) == ("timer", "tick")
    assert 0.0 < tick["mean_ms"] <= tick["longest_ms"]
    assert tick["late_longest_ms"] > 0.0

    text = repeated_until(
        lambda text: callback_in(text).get("calls_hz") == pytest.approx(20.0, abs=5.0),
        *("top", "--once", "--json"),
    )
    callback = callback_in(text)
    assert callback["node"] == "/fleet/planner"
    assert callback["calls_hz"] == pytest.approx(20.0, abs=5.0)
    assert 0.0 < callback["busy"] < 1.0
    assert callback["count"] > tick["count"]
    for options in ((), ("--json",)):
        shown = on_a_terminal("top", "--once", *options)
        assert "/fleet/planner" in shown
        assert "\x1b" not in shown  # it does not use the full screen
    assert robot.began_s <= planner["since_s"] <= time.time()

    refusal = refused("run", robot.path)
    assert f"process {robot.pid}" in refusal
    assert "system '/fleet/robot' already runs in ROS domain" in refusal
    assert "stop it with 'compose down /fleet/robot'" in refusal

    assert output_of("down", "robot").startswith("/fleet/robot: the system has stopped")
    # 'down' waits until the instance lock is released; the summary is printed later.
    summary = re.compile(r"ran for .*\n/fleet/planner +timer 'tick' +\d+", re.DOTALL)
    wait_until(lambda: summary.search(robot.log.read_text()), "the summary")
    refusal = refused("down", robot.path)
    assert refusal.startswith("compose: there is no running system 'robot'")
    assert "no system is running: start one with 'compose run'" in refusal

    # No command leaves an empty log of rcl.
    (log,) = (file for file in robot.log.parent.iterdir() if file.name != "compose")
    line = r"^\[20[-0-9]{8} [:0-9]{8}\.\d{3}\] \[INFO\] \[compose\] /fleet/planner active$"
    assert re.search(line, log.read_text(), re.MULTILINE)


def test_commands_to_a_whole_system(robot: Robot) -> None:
    def sent(verb: str, system: object) -> str:
        return repeated_until(bool, "lifecycle", verb, system)

    none, two = (f"/fleet/robot: {count} of 3 nodes active\n" for count in (0, 2))
    assert refused("lifecycle", "pause", "zebra").endswith("\n  available: /fleet/robot\n")
    assert sent("pause", "robot") == none
    assert robot.states() == dict.fromkeys(robot.states(), "inactive")
    assert sent("resume", "/fleet/robot") == two
    assert sent("reset", robot.path) == none
    assert robot.states() == dict.fromkeys(robot.states(), "unconfigured")

    set_fault("configure")
    failed = "compose: /fleet/robot did not come up: /fleet/planner"
    cause = "configure failed: ValueError: no map"
    refusal = refused("lifecycle", "startup", "robot", "--all-or-nothing")
    assert refusal.startswith(f"{failed}: {cause}; rolled back")
    assert robot.states() == dict.fromkeys(robot.states(), "unconfigured")
    assert refused("lifecycle", "startup", "robot").startswith(
        f"{failed} failed; 0 of 3 nodes active, /fleet/planner is isolated: {cause}\n"
    )
    set_fault("none")
    assert sent("startup", "robot") == two
    hint = refused("lifecycle", "startup", "rowbot").splitlines()[1]
    assert hint == "  did you mean '/fleet/robot'?"


def test_nodes_are_restarted_in_order_with_their_dependents(robot: Robot) -> None:
    before = len(robot.messages("/fleet/motor active", robot.text.partition(" (")[0]))
    assert repeated_until(bool, "lifecycle", "restart", "planner") == (
        "/fleet/planner: restarted (2 of 3 nodes active)\n"
    )
    requested = "restart of /fleet/planner requested"
    wait_until(lambda: len(robot.messages(requested)) >= before + 8, "the log of the restart")
    assert robot.messages()[before:] == [
        requested,
        "/fleet/motor inactive",
        "/fleet/planner inactive",
        "/fleet/planner unconfigured",
        "/fleet/planner inactive",
        "/fleet/planner active",
        "go",
        "/fleet/motor active",
    ]
    moved("planner", "shutdown")
    assert robot.states()["/fleet/planner"] == "finalized"
    assert repeated_until(bool, "lifecycle", "restart", "*/planner", "camera") == (
        "/fleet/planner, /fleet/camera: restarted (2 of 3 nodes active)\n"
    )
    assert robot.states()["/fleet/motor"] == "active"
    assert robot.states()["/fleet/camera"] == "inactive"
    set_fault("configure")
    refusal = refused("lifecycle", "restart", "planner")
    assert "/fleet/planner: the restart failed: /fleet/planner: configure failed: " in refusal
    listed(("no map",), "logs", "planner", "--level", "error")
    expect_error("did you mean '/fleet/planner'?", "lifecycle", "restart", "planer")
    assert "no line of" not in output_of("logs", "-n", 3, "motor", "--since", "10m")


def test_lifecycle_set_with_dependents_several_nodes_and_patterns(robot: Robot) -> None:
    done = lifecycle_set("planner", "deactivate")
    assert (done.returncode, done.stdout) == (0, "/fleet/planner: active -> inactive\n")
    assert done.stderr == (
        "note: active nodes depend on this: /fleet/motor; --dependents deactivates them first\n"
    )
    assert robot.states()["/fleet/motor"] == "active"
    done = lifecycle_set("planner", "activate")
    assert (done.returncode, done.stderr) == (0, "")
    text = moved("planner", "--to", "unconfigured", "--dependents")
    assert text.splitlines() == [
        "/fleet/motor: active -> inactive",
        "/fleet/planner: active -> unconfigured",
    ]
    text = moved("planner", "--to", "active", "--dependents")
    assert text.splitlines() == [
        "/fleet/planner: unconfigured -> active",
        "/fleet/motor: inactive -> active",
    ]

    text = moved("motor", "planner", "deactivate")
    assert text == "/fleet/motor: active -> inactive\n/fleet/planner: active -> inactive\n"
    text = moved("/fleet/[mp]*", "--to", "active")
    assert text == "/fleet/motor: inactive -> active\n/fleet/planner: inactive -> active\n"
    moved("/fleet/[mp]*", "--to", "inactive")
    done = lifecycle_set("camera", "planner", "cleanup")
    assert done.returncode == 0
    done = lifecycle_set("camera", "motor", "cleanup")
    assert (done.returncode, done.stdout) == (1, "/fleet/motor: inactive -> unconfigured\n")
    assert "'cleanup' is not possible: /fleet/camera is unconfigured" in done.stderr
    assert "available transitions: configure, shutdown" in done.stderr
    unknown = "there is no lifecycle node matching 'x*'"
    expect_error(unknown, "lifecycle", "set", "x*", "cleanup")
    moved("camera", "--to", "finalized")
    final = "'active' cannot be reached: /fleet/camera is finalized"
    expect_error(final, "lifecycle", "set", "camera", "--to", "active")
    for arguments in (["motor"], ["--to", "active"]):
        assert compose("lifecycle", "set", *arguments).returncode in (1, 2)


def test_unresponsive_nodes_and_systems_are_reported_in_time(robot: Robot) -> None:
    moved("planner", "deactivate")
    set_fault("hang")
    silent = "/fleet/planner did not respond within 5 s"
    expect_error(silent, "lifecycle", "set", "planner", "activate", "--timeout", 5)
    assert robot.states()["/fleet/planner"] == "activating"

    robot.kill(signal.SIGSTOP)
    try:
        refusal = refused("lifecycle", "pause", "robot", "--timeout", 1.5)
        assert f"its process is {robot.pid}" in refusal
        listed(("no response, its process may be busy or gone",), "ps")
        silent = "system '/fleet/robot' does not respond, so its nodes are not known"
        queries = (("nodes",), ("get", "planner"), ("set", "/fleet/*", "cleanup"))
        for refusal in expect_errors(*((silent, "lifecycle", *words) for words in queries)):
            assert f"its process {robot.pid} may be busy or stopped" in refusal
    finally:
        robot.kill(signal.SIGCONT)


def test_a_killed_system_is_not_running_and_no_command_waits_for_it(robot: Robot) -> None:
    set_fault("hang")
    repeated_until(bool, "lifecycle", "pause", "robot")
    # By itself, it would wait longer than this test may take.
    with start("lifecycle", "resume", "robot", "--timeout", "600") as resuming:
        assert resuming.stderr is not None
        wait_until(lambda: robot.states()["/fleet/planner"] == "activating", "it hangs")
        robot.kill()
        refusal = resuming.stderr.read()
    assert resuming.returncode == 1
    assert "/fleet/robot did not resume: its process has ended" in refusal

    wait_until(lambda: not local_systems(), "its end")
    assert output_of("ps") == "no system is running\n"
    assert output_of("lifecycle", "nodes") == ""
    none = "there is no running system 'robot'"
    verbs = [("lifecycle", verb) for verb in ("startup", "pause", "resume", "reset")]
    expect_errors(*((none, *words, "robot") for words in (("ps",), ("down",), *verbs)))
    by_path, misspelled, by_name, get = errors(
        ("ps", robot.path),
        ("ps", robot.path.with_name("robt.yaml")),
        ("lifecycle", "set", "planner", "deactivate"),
        ("lifecycle", "get", "/fleet/planner"),
    )
    assert "no system is running: start one with" in by_path
    assert "did you mean" in misspelled
    for text in (by_name, get):
        assert "there is no lifecycle node " in text


def test_a_failed_bring_up_ends_the_background_process(path: Path) -> None:
    fault = ("--set", "planner.fault=configure")
    refusal = refused("run", path, "--wait", "--all-or-nothing", *fault)
    assert "the system did not come up (exit code 1):" in refusal
    assert "/fleet/planner failed" in refusal
    # The limit is long enough to reach the node that hangs on a busy machine.
    late = "rolling back because of /fleet/planner: bring-up timed out after 5 s"
    expect_error(late, "run", path, "--timeout", 5, "--set", "planner.fault=hang", "--grace", 3)


WARNING = """\
system: s
nodes:
  b: {on_activate: {log: hi}}  # compose: ignore[qos-implicit]
"""


@pytest.mark.parametrize(
    ("command", "color"), [("validate", "\x1b[1;33mwarning["), ("graph", "1 warning: see")]
)
def test_warnings_are_not_red_on_a_terminal(tmp_path: Path, command: str, color: str) -> None:
    file = tmp_path / "s.yaml"
    file.write_text(WARNING, encoding="utf-8")
    shown = on_a_terminal(*command.split(), str(file))
    assert color in shown
    assert not re.search(r"\x1b\[[0-9;]*31m", shown)
