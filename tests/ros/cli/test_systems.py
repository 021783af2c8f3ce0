"""Commands to running systems: run, ps, down and top, also of systems that do not answer."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from composer.runtime.process.instance_lock import local_systems
from tests.ros.support.background import Robot, moved, refused, set_fault
from tests.ros.support.commands import (
    COMPOSE,
    errors,
    expect_error,
    expect_errors,
    listed,
    output_of,
    repeated_until,
    start,
)
from tests.ros.support.in_process import wait_until


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
