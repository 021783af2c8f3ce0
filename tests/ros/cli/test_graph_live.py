"""``compose graph --live``: the running nodes with states and measured rates."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.ros.support.commands import compose, hand_written, repeated, running
from tests.ros.support.in_process import wait_until

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


def test_the_pipeline_and_plain_nodes_are_drawn(tmp_path: Path) -> None:
    with hand_written("hand_written.py"), running(tmp_path / "log.txt", "pipeline") as run:
        run.wait_for("3 of 3 nodes active")
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
