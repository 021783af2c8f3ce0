"""``compose doctor``, ``topic delay`` and a lost action server, on nodes that others wrote."""

from __future__ import annotations

import json
import re
import signal
import subprocess
from collections.abc import Iterator
from typing import Any

import pytest

from composer.doctor.finding import Level
from composer.doctor.graph import unbuilt_types
from tests.ros.support.commands import PATIENCE_S, compose, hand_written, measured, start


@pytest.fixture(scope="module")
def misfits(shared_domain_id: int) -> Iterator[subprocess.Popen[str]]:
    with hand_written("hand_written_misfits.py") as process:
        yield process


@pytest.fixture(scope="module")
def found(misfits: subprocess.Popen[str]) -> list[dict[str, str]]:
    assert misfits.poll() is None
    done = compose("doctor", "--json")
    assert done.returncode == 1, done.stderr
    findings: list[dict[str, str]] = json.loads(done.stdout)
    return findings


def messages(found: list[dict[str, str]], area: str, level: str) -> list[str]:
    return [item["message"] for item in found if (item["area"], item["level"]) == (area, level)]


def test_ends_that_cannot_match_are_named_with_the_policy(found: list[dict[str, str]]) -> None:
    assert messages(found, "qos", "error") == [
        "/lab/scan: /lab/scanner offers reliability best_effort, /lab/mapper requests reliable:"
        " no message goes between them"
    ]


def test_a_topic_with_two_types_and_nodes_with_one_name_are_told(
    found: list[dict[str, str]],
) -> None:
    (mixed,) = messages(found, "graph", "error")
    assert mixed.startswith("topic /lab/mixed has more than one type: std_msgs/msg/Int32, ")
    (twins,) = messages(found, "graph", "warning")
    assert twins.startswith("2 nodes are called /lab/twin")


def test_all_that_is_not_well_has_a_remedy_and_the_rest_is_told(
    found: list[dict[str, str]],
) -> None:
    assert all(item["remedy"] for item in found if item["level"] != "ok")
    assert messages(found, "middleware", "ok") == ["rmw_fastrtps_cpp"]
    (met,) = messages(found, "discovery", "ok")
    assert met.startswith("two participants met after")
    assert messages(found, "interfaces", "warning") == []


def test_a_type_that_is_not_built_here_is_told_once() -> None:
    used = [
        ("topic", "/grip", ("arm_interfaces/msg/Grip",)),
        ("topic", "/grips", ("arm_interfaces/msg/Grip", "std_msgs/msg/String")),
    ]
    (finding,) = unbuilt_types(used)
    assert finding.level is Level.WARNING
    assert finding.message.startswith("arm_interfaces/msg/Grip (topic /grip) is not built here")


@pytest.mark.usefixtures("misfits")
def test_delay_is_the_age_of_the_stamp() -> None:
    def is_prompt(delay: dict[str, Any]) -> bool:
        """A command that gets no processor for a moment finds older messages afterwards."""
        assert delay["window"] == 20
        assert 0.25 <= delay["shortest_s"] <= delay["average_s"]
        return bool(delay["average_s"] < 0.35)

    assert is_prompt(measured(is_prompt, "topic", "delay", "/lab/scan", "--count", "20", "--json"))
    text = compose("topic", "delay", "/lab/scan", "--count", "2").stdout
    told = re.match(r"average delay: (\d+\.\d{4}) s  min: ", text)
    assert told is not None
    assert float(told[1]) >= 0.25


@pytest.mark.usefixtures("misfits")
def test_only_messages_that_the_filter_lets_through_are_measured() -> None:
    # The topic has to be found within the same time.
    wanted = ("--filter", "message.header.stamp.nanosec < 0", "--timeout", "5")
    done = compose("topic", "delay", "/lab/scan", "--count", "2", *wanted)
    assert (done.returncode, done.stdout) == (1, "")
    assert "nothing came over '/lab/scan' for 5 s" in done.stderr


@pytest.mark.usefixtures("misfits")
def test_delay_needs_a_stamp() -> None:
    done = compose("topic", "delay", "/lab/plain", "--qos-depth", "5")
    assert done.returncode == 1
    assert "Int32 has no header.stamp" in done.stderr


# The last one: it ends the process of the others.
def test_a_goal_whose_server_goes_away_ends(misfits: subprocess.Popen[str]) -> None:
    process = start("action", "send-goal", "/lab/endless", "{}")
    assert process.stderr is not None
    assert any("goal accepted" in line for line in process.stderr)
    misfits.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 1
    assert "the server of '/lab/endless' is gone, and the goal with it" in err
