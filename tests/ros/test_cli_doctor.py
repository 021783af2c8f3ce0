"""``compose doctor``, ``topic delay`` and a lost action server, on nodes that others wrote."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from composer.runtime.doctor.finding import Level
from composer.runtime.doctor.graph import unbuilt_types

COMPOSE = [sys.executable, "-m", "composer"]
PEER = Path(__file__).with_name("hand_written_misfits.py")
PATIENCE_S = 30.0


@pytest.fixture(scope="module")
def misfits(shared_domain_id: int) -> Iterator[subprocess.Popen[str]]:
    process = subprocess.Popen([sys.executable, str(PEER)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert "ready\n" in process.stdout
    yield process
    process.kill()
    process.wait()


def compose(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*COMPOSE, *arguments], check=False, capture_output=True, text=True, timeout=PATIENCE_S
    )


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
    until_s = time.monotonic() + PATIENCE_S
    while True:
        done = compose("topic", "delay", "/lab/scan", "--count", "20", "--json")
        delay = json.loads(done.stdout.splitlines()[-1])
        assert delay["window"] == 20
        assert 0.25 <= delay["shortest_s"] <= delay["average_s"]
        # A command that gets no processor for a moment finds older messages afterwards.
        if delay["average_s"] < 0.35 or time.monotonic() > until_s:
            break
    assert delay["average_s"] < 0.35
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
    process = subprocess.Popen(
        [*COMPOSE, "action", "send-goal", "/lab/endless", "{}"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    assert any("goal accepted" in line for line in process.stderr)
    misfits.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 1
    assert "the server of '/lab/endless' is gone, and the goal with it" in err
