"""The debugging commands on a system that ``compose run`` runs in another terminal."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

COMPOSE = [sys.executable, "-m", "composer"]
PATIENCE_S = 30.0


@pytest.fixture(scope="module", autouse=True)
def pipeline(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    log: Path = tmp_path_factory.mktemp("pipeline") / "stderr.txt"
    with log.open("w") as file:
        process = subprocess.Popen([*COMPOSE, "run", "pipeline"], stderr=file)
    until_s = time.monotonic() + PATIENCE_S
    while "3 of 3 nodes active" not in log.read_text():
        assert process.poll() is None, log.read_text()
        assert time.monotonic() < until_s, log.read_text()
        time.sleep(0.02)
    yield
    process.terminate()
    process.wait()


def out(*arguments: str) -> str:
    done = subprocess.run(
        [*COMPOSE, *arguments], check=False, capture_output=True, text=True, timeout=PATIENCE_S
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_doctor_finds_no_fault() -> None:
    found = json.loads(out("doctor", "--json"))
    assert [item for item in found if item["level"] in ("warning", "error")] == []
    (graph,) = (item["message"] for item in found if item["area"] == "graph")
    assert graph.startswith("all ends fit: ")


def test_messages_are_fresh() -> None:
    delay = json.loads(out("topic", "delay", "/sensor_data", "--count", "20", "--json"))
    assert 0.0 < delay["average_s"] < 0.1


def test_who_is_at_the_ends_and_what_is_offered() -> None:
    found = json.loads(out("topic", "info", "-v", "/sensor_data", "--json"))
    assert [end["node"] for end in found["publishers"]] == ["/perception/sensor_simulator"]
    assert [end["qos"]["reliability"] for end in found["subscriptions"]] == ["best_effort"] * 2


def test_a_service_answers_in_yaml() -> None:
    answer = yaml.safe_load(out("service", "call", "/plan_trajectory", "{max_velocity: 0.5}"))
    assert "success" in answer
