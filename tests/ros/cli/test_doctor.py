"""``compose doctor`` and a lost action server, with plain rclpy nodes; missing security."""

from __future__ import annotations

import json
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from composer.client.doctor import Level
from composer.client.doctor.graph import check_types_built
from tests.ros.support.commands import PATIENCE_S, compose, hand_written, repeated, start


@pytest.fixture(scope="module")
def incompatible_nodes(shared_domain_id: int) -> Iterator[subprocess.Popen[str]]:
    with hand_written("hand_written_incompatible.py") as process:
        yield process


def test_problems_of_the_graph_are_reported_with_remedies(
    incompatible_nodes: subprocess.Popen[str],
) -> None:
    expected = ("/lab/scan: ", "topic /lab/mixed has more than one type", "/lab/twin: ")
    done = repeated(lambda done: all(part in done.stdout for part in expected), "doctor", "--json")
    assert done.returncode == 1, done.stderr
    found = json.loads(done.stdout)

    def messages(area: str, level: str) -> list[str]:
        return [item["message"] for item in found if (item["area"], item["level"]) == (area, level)]

    assert all(item["remedy"] for item in found if item["level"] != "ok")
    assert messages("qos", "error") == [
        "/lab/scan: /lab/scanner offers reliability best_effort, /lab/mapper requests reliable:"
        " no messages are delivered"
    ]
    (mixed,) = messages("graph", "error")
    assert mixed.startswith("topic /lab/mixed has more than one type: std_msgs/msg/Int32, ")
    (twins,) = messages("graph", "warning")
    assert twins.startswith("2 nodes have the name /lab/twin")
    assert messages("middleware", "ok") == ["rmw_fastrtps_cpp"]
    (discovered,) = messages("discovery", "ok")
    assert discovered.startswith("two participants discovered each other within")
    assert messages("interfaces", "warning") == []


def test_a_lost_action_server_is_reported(incompatible_nodes: subprocess.Popen[str]) -> None:
    goal = ("action", "send-goal", "/lab/endless", "composer_interfaces/action/Navigate", "{}")
    process = start(*goal, "--timeout", "20")
    assert process.stderr is not None
    assert any("goal accepted" in line for line in process.stderr)
    incompatible_nodes.send_signal(signal.SIGINT)  # the last test with these nodes
    _, err = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 1
    assert "the server of '/lab/endless' is gone, so the goal is lost" in err


def test_a_missing_type_is_reported_once() -> None:
    used = [
        ("topic", "/grip", ("arm_interfaces/msg/Grip",)),
        ("topic", "/grips", ("arm_interfaces/msg/Grip", "std_msgs/msg/String")),
    ]
    (result,) = check_types_built(used)
    assert result.level is Level.WARNING
    assert result.message.startswith("arm_interfaces/msg/Grip (topic /grip) is not installed")


KEYS = (
    "cert.pem",
    "governance.p7s",
    "identity_ca.cert.pem",
    "key.pem",
    "permissions.p7s",
    "permissions_ca.cert.pem",
)


def test_security_without_its_libraries_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Security is enabled, but the middleware cannot do it, as in the wheels from PyPI."""
    enclaves = tmp_path / "keys" / "enclaves"
    enclaves.mkdir(parents=True)
    for name in KEYS:
        (enclaves / name).touch()
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    monkeypatch.setenv("ROS_SECURITY_STRATEGY", "Enforce")
    monkeypatch.setenv("ROS_SECURITY_KEYSTORE", str(tmp_path / "keys"))
    path = tmp_path / "lamp.yaml"
    path.write_text("system: lamp\nnodes:\n  one: {on_activate: {log: started}}\n")
    reason = "security is enabled, but this build of Fast DDS has no security libraries"
    for command in (("node", "list"), ("run", path)):
        done = compose(*command)
        assert done.returncode == 1
        assert f"compose: ROS does not start: {reason}\n" in done.stderr
        assert "unset ROS_SECURITY_ENABLE" in done.stderr
        assert "internal error" not in done.stderr
    done = compose("doctor")
    assert done.returncode == 1
    assert f"error    middleware   ROS does not start: {reason}\n" in done.stdout
