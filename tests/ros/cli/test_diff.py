"""``compose diff`` on a system that runs in another process."""

from __future__ import annotations

import json
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

import pytest

from tests.ros.support.commands import (
    PATIENCE_S,
    Running,
    hand_written,
    listed,
    repeated,
    running,
    start,
)

INTRUDER = ("roles.py", "intruder")
PLANNER = "/planning/planner"


@pytest.fixture(scope="module")
def pipeline(tmp_path_factory: pytest.TempPathFactory, shared_domain_id: int) -> Iterator[Running]:
    with running(tmp_path_factory.mktemp("pipeline") / "log.txt", "pipeline") as run:
        run.wait_for("3 of 3 nodes active")
        yield run
        assert run.stop()[0] == 0


def differences(done: subprocess.CompletedProcess[str]) -> list[str]:
    """Return the differences, without hints and locations."""
    return [line for line in done.stdout.splitlines() if not line.startswith(" ")]


def compared(expected: list[str], *arguments: object) -> subprocess.CompletedProcess[str]:
    """Compare until these are the differences; a process may be discovered or respond late."""
    code = 1 if expected else 0
    return repeated(
        lambda done: (done.returncode, differences(done)) == (code, expected), "diff", *arguments
    )


def set_velocity(value: float) -> None:
    assert listed((str(value),), "param", "set", PLANNER, "max_velocity", str(value))


def test_a_system_without_differences(pipeline: Running) -> None:
    done = compared([], "systems/pipeline.yaml")
    assert done.stderr == "pipeline: runs as declared\n"


def test_a_changed_parameter_is_reported_with_its_declaration(pipeline: Running) -> None:
    set_velocity(0.5)
    message = f"{PLANNER}: parameter max_velocity is 0.5, declared 1.0"
    done = compared([message], "systems/pipeline.yaml")
    assert "declared at " in done.stdout
    assert "planner.yaml:" in done.stdout
    set_velocity(1.0)


def test_an_external_publisher_of_another_type_is_reported(pipeline: Running) -> None:
    conflict = (
        "/intruder: type of its publisher /sensor_data is std_msgs/msg/String,"
        " declared nav_msgs/msg/Odometry"
    )
    extra = "/intruder: the node exists, but is not declared"

    def messages(done: subprocess.CompletedProcess[str]) -> list[str]:
        found = json.loads(done.stdout or '{"drift": []}')
        return [item["message"] for item in found["drift"]]

    with hand_written(*INTRUDER):
        done = repeated(
            lambda done: messages(done) == [conflict, extra],
            *("diff", "systems/pipeline.yaml", "--json"),
        )
        assert done.returncode == 1
        data = json.loads(done.stdout)
        assert (data["system"], data["clean"]) == ("pipeline", False)
        assert messages(done) == [conflict, extra]
        assert [item["kind"] for item in data["drift"]] == ["wrong type", "extra node"]
        compared([conflict], "systems/pipeline.yaml", "--ignore", "/intr*")


def test_watch_prints_new_and_resolved_differences(pipeline: Running) -> None:
    watch = start("diff", "systems/pipeline.yaml", "--watch", "--grace", "1.5")
    try:
        assert watch.stdout is not None
        set_velocity(0.7)
        # On a busy machine, what is not discovered within the grace time is reported before.
        line = read_until(watch.stdout, f"drift: {PLANNER}: parameter")
        assert line == f"drift: {PLANNER}: parameter max_velocity is 0.7, declared 1.0"
        set_velocity(1.0)
        read_until(watch.stdout, f"resolved: {PLANNER}: parameter")
        watch.send_signal(signal.SIGINT)
        assert watch.communicate(timeout=PATIENCE_S)[1] == ""
        assert watch.returncode == 0
    finally:
        watch.kill()
        watch.wait()


def read_until(stream: TextIO, begin: str) -> str:
    return next(line.rstrip() for line in stream if line.startswith(begin))


def test_a_starting_system_is_not_reported(tmp_path: Path) -> None:
    with running(tmp_path / "log.txt", "talker_listener"):
        # On a busy machine, a start may take longer than the default grace time.
        limits = ("--grace", "15", "--timeout", "25")
        compared([], "systems/talker_listener.yaml", "--ignore", "/*/*", *limits)


def test_start_options_apply_to_the_comparison(tmp_path: Path) -> None:
    arguments = ("talker_listener", "--namespace", "/robot1", "--autostart", "inactive")
    with running(tmp_path / "log.txt", *arguments) as run:
        run.wait_for("0 of 2 nodes active")
        compared([], *arguments, "--ignore", "/[!r]*")
