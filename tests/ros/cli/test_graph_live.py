"""``compose graph --live``: the running nodes with states and measured rates."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from typing import Any

import pytest

from tests.ros.support.commands import PATIENCE_S, compose, hand_written, repeated, running

EXPECTED = (
    "node:/other/arm",
    "2 nodes have this name",
    "publisher:/perception/sensor_simulator./sensor_data",
    "publisher:/other/arm./arms",
    "client:/control/motor_controller./plan_trajectory",
    "action_server:/control/motor_controller./navigate",
)


@pytest.fixture(scope="module")
def live(
    tmp_path_factory: pytest.TempPathFactory, shared_domain_id: int
) -> Iterator[dict[str, Any]]:
    """The diagram of the pipeline and of plain rclpy nodes."""
    log = tmp_path_factory.mktemp("live") / "log.txt"
    with hand_written("hand_written.py"), running(log, "pipeline") as run:
        run.wait_for("3 of 3 nodes active")
        yield all_drawn()


def all_drawn() -> dict[str, Any]:
    """Draw until the diagram is complete, because discovery may take longer on a busy machine."""
    until_s = time.monotonic() + PATIENCE_S
    while True:
        found = drawn()
        states = [vertex["details"].get("state") for vertex in found["vertices"]]
        text = json.dumps(found)
        if (
            states.count("active") >= 2
            and "unconfigured" in states
            and all(f'"{part}"' in text for part in EXPECTED)
        ) or time.monotonic() > until_s:
            return found


def drawn() -> dict[str, Any]:
    done = repeated(
        lambda done: (done.returncode, done.stderr) == (0, ""),
        *("graph", "--live", "-f", "json", "--measure", "1.5"),
    )
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def vertices(live: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {vertex["key"]: vertex for vertex in live["vertices"]}


def edges(live: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {edge["key"]: edge for edge in live["edges"]}


def test_all_nodes_are_drawn_with_their_states(live: dict[str, Any]) -> None:
    states = {
        key: vertex["details"].get("state")
        for key, vertex in vertices(live).items()
        if vertex["kind"] == "node"
    }
    assert states["node:/planning/planner"] in ("active", "unconfigured")  # there are two of them
    assert states["node:/control/motor_controller"] == "active"
    assert states["node:/other/arm"] == "unconfigured"


def test_a_duplicate_node_name_is_marked(live: dict[str, Any]) -> None:
    assert vertices(live)["node:/planning/planner"]["wrong"] == "2 nodes have this name"


def test_rates_are_measured(live: dict[str, Any]) -> None:
    expected = pytest.approx(30.0, rel=0.25)
    publisher = "publisher:/perception/sensor_simulator./sensor_data"
    until_s = time.monotonic() + PATIENCE_S
    # A simulator that is not scheduled for a moment sends fewer messages, and is discovered late.
    while edges(live).get(publisher, {"details": {}})["details"].get("rate_hz") != expected:
        assert time.monotonic() < until_s
        live = drawn()
    assert edges(live)[publisher]["label"][0].endswith(" Hz")


def test_views_that_need_a_file_are_rejected() -> None:
    done = compose("graph", "--live", "--view", "lifecycle")
    assert (done.returncode, done.stdout) == (2, "")
    assert "nodes, connections, deployment or states" in done.stderr


def test_an_empty_graph_is_drawn_in_time() -> None:
    done = compose("graph", "--live", "--timeout", "2")
    assert done.returncode == 0
    assert "flowchart" in done.stdout
