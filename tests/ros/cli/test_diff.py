"""``compose diff`` and ``compose graph --live`` on systems that run in other processes."""

from __future__ import annotations

import json
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TextIO

import pytest

from tests.ros.support.commands import (
    PATIENCE_S,
    Running,
    compose,
    hand_written,
    listed,
    repeated,
    running,
    start,
)
from tests.ros.support.in_process import wait_until

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


def test_a_changed_parameter_is_reported_with_its_declaration(pipeline: Running) -> None:
    done = compared([], "systems/pipeline.yaml")
    assert done.stderr == "pipeline: runs as declared\n"
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


def test_start_options_apply_and_a_starting_system_is_not_reported(tmp_path: Path) -> None:
    arguments = ("talker_listener", "--namespace", "/robot1", "--autostart", "inactive")
    with running(tmp_path / "log.txt", *arguments) as run:
        # On a busy machine, a start may take longer than the default grace time.
        limits = ("--grace", "15", "--timeout", "25")
        compared([], *arguments, "--ignore", "/[!r]*", *limits)
        run.wait_for("0 of 2 nodes active")
        compared([], *arguments, "--ignore", "/[!r]*")


PUBLISHER = "publisher:/perception/sensor_simulator./sensor_data"
EXPECTED = (
    "node:/other/arm",
    "2 nodes have this name",
    PUBLISHER,
    "publisher:/other/arm./arms",
    "client:/control/motor_controller./plan_trajectory",
    "action_server:/control/motor_controller./navigate",
)


def drawn() -> dict[str, Any]:
    done = repeated(
        lambda done: (done.returncode, done.stderr) == (0, ""),
        *("graph", "--live", "-f", "json", "--measure", "1.5"),
    )
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def is_complete(diagram: dict[str, Any]) -> bool:
    """Return whether everything is discovered, which may take longer on a busy machine."""
    states = [vertex["details"].get("state") for vertex in diagram["vertices"]]
    text = json.dumps(diagram)
    return (
        states.count("active") >= 2
        and "unconfigured" in states
        and all(f'"{part}"' in text for part in EXPECTED)
    )


def test_the_pipeline_and_plain_nodes_are_drawn(pipeline: Running) -> None:
    with hand_written("hand_written.py"):
        diagrams: list[dict[str, Any]] = []

        def fits() -> bool:
            """A simulator that is not scheduled for a moment sends fewer messages."""
            diagrams.append(drawn())
            edges = {edge["key"]: edge for edge in diagrams[-1]["edges"]}
            rate_hz = edges.get(PUBLISHER, {"details": {}})["details"].get("rate_hz")
            return is_complete(diagrams[-1]) and rate_hz == pytest.approx(30.0, rel=0.25)

        wait_until(fits, "a complete diagram")
    nodes = {vertex["key"]: vertex for vertex in diagrams[-1]["vertices"]}
    states = {key: vertex["details"].get("state") for key, vertex in nodes.items()}
    assert states["node:/planning/planner"] in ("active", "unconfigured")  # there are two of them
    assert states["node:/control/motor_controller"] == "active"
    assert states["node:/other/arm"] == "unconfigured"
    assert nodes["node:/planning/planner"]["wrong"] == "2 nodes have this name"
    (publisher,) = (edge for edge in diagrams[-1]["edges"] if edge["key"] == PUBLISHER)
    assert publisher["label"][0].endswith(" Hz")


def test_an_empty_graph_is_drawn_in_time_and_views_that_need_a_file_are_rejected() -> None:
    done = compose("graph", "--live", "--timeout", "2")
    assert done.returncode == 0
    assert "flowchart" in done.stdout
    done = compose("graph", "--live", "--view", "lifecycle")
    assert (done.returncode, done.stdout) == (2, "")
    assert "nodes, connections, deployment or states" in done.stderr
