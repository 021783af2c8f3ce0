"""``compose doctor``, ``topic delay`` and a lost action server, with plain rclpy nodes."""

from __future__ import annotations

import json
import signal
import subprocess
from collections.abc import Iterator

import pytest

from composer.client.doctor import Level
from composer.client.doctor.graph import check_types_built
from tests.ros.support.commands import (
    PATIENCE_S,
    hand_written,
    repeated,
    start,
)


@pytest.fixture(scope="module")
def incompatible_nodes(shared_domain_id: int) -> Iterator[subprocess.Popen[str]]:
    with hand_written("hand_written_incompatible.py") as process:
        yield process


@pytest.fixture(scope="module")
def found(incompatible_nodes: subprocess.Popen[str]) -> list[dict[str, str]]:
    assert incompatible_nodes.poll() is None
    expected = ("/lab/scan: ", "topic /lab/mixed has more than one type", "/lab/twin: ")
    done = repeated(lambda done: all(part in done.stdout for part in expected), "doctor", "--json")
    assert done.returncode == 1, done.stderr
    results: list[dict[str, str]] = json.loads(done.stdout)
    return results


def messages(found: list[dict[str, str]], area: str, level: str) -> list[str]:
    return [item["message"] for item in found if (item["area"], item["level"]) == (area, level)]


def test_incompatible_qos_is_reported_with_the_policy(found: list[dict[str, str]]) -> None:
    assert messages(found, "qos", "error") == [
        "/lab/scan: /lab/scanner offers reliability best_effort, /lab/mapper requests reliable:"
        " no messages are delivered"
    ]


def test_conflicting_types_and_node_names_are_reported(
    found: list[dict[str, str]],
) -> None:
    (mixed,) = messages(found, "graph", "error")
    assert mixed.startswith("topic /lab/mixed has more than one type: std_msgs/msg/Int32, ")
    (twins,) = messages(found, "graph", "warning")
    assert twins.startswith("2 nodes have the name /lab/twin")


def test_problems_have_remedies_and_other_results_are_reported(
    found: list[dict[str, str]],
) -> None:
    assert all(item["remedy"] for item in found if item["level"] != "ok")
    assert messages(found, "middleware", "ok") == ["rmw_fastrtps_cpp"]
    (discovered,) = messages(found, "discovery", "ok")
    assert discovered.startswith("two participants discovered each other within")
    assert messages(found, "interfaces", "warning") == []


def test_a_missing_type_is_reported_once() -> None:
    used = [
        ("topic", "/grip", ("arm_interfaces/msg/Grip",)),
        ("topic", "/grips", ("arm_interfaces/msg/Grip", "std_msgs/msg/String")),
    ]
    (result,) = check_types_built(used)
    assert result.level is Level.WARNING
    assert result.message.startswith("arm_interfaces/msg/Grip (topic /grip) is not installed")


# Must be the last test, because it ends the process of the nodes.
def test_a_lost_action_server_is_reported(incompatible_nodes: subprocess.Popen[str]) -> None:
    goal = ("action", "send-goal", "/lab/endless", "composer_interfaces/action/Navigate", "{}")
    process = start(*goal, "--timeout", "20")
    assert process.stderr is not None
    assert any("goal accepted" in line for line in process.stderr)
    incompatible_nodes.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 1
    assert "the server of '/lab/endless' is gone, so the goal is lost" in err
