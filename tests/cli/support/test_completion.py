"""Shell completion, with the protocol of bash."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from composer.cli.support import completion
from composer.cli.support.completion import (
    Complete,
    complete_action,
    complete_message_type,
    complete_node,
    complete_rule,
    complete_running_system,
    complete_service,
    complete_topic,
    complete_type,
    silent,
)
from composer.cli.support.system_arguments import complete_system
from composer.client.systems import local_queries
from composer.runtime.process.instance_lock import hold_instance_lock
from composer.runtime.process.query_socket import QuerySocket
from composer.runtime.protocol.requests import GraphAnswer, GraphQuery, GraphView
from tests.cli.compose import compose, run_python, write_files


def environment_of(words: tuple[str, ...]) -> dict[str, str]:
    """Return what bash sets to complete the last word after ``compose``."""
    return {
        "_COMPOSE_COMPLETE": "complete_bash",
        "COMP_WORDS": " ".join(["compose", *words]),
        "COMP_CWORD": str(len(words)),
    }


def complete(*words: str) -> list[str]:
    with pytest.MonkeyPatch.context() as environment:
        for name, value in environment_of(words).items():
            environment.setenv(name, value)
        done = compose()
    assert (done.code, done.err) == (0, "")
    return done.out.split()


def test_a_program_of_its_own_completes() -> None:
    code = "import sys; from composer.cli import main; sys.exit(main())"
    environment = {**os.environ, **environment_of(("run", "--auto"))}
    done = run_python("-c", code, env=environment)
    assert done.stdout.split() == ["--autostart"]


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (["gra"], ["graph"]),
        (["lifecycle", "se"], ["set"]),
        (["run", "--auto"], ["--autostart"]),
        (["run", "pipeline", "--autostart", "in"], ["inactive"]),
        (["run", "pi"], ["pipeline"]),
        (["run", "s.yaml", ""], ["sim=false", "sim=true", "lidar=sick", "lidar=ouster", "rate="]),
        (["config", "s.yaml", "lidar=o"], ["lidar=ouster"]),
        # bash makes words of "lidar", "=" and what follows
        (["run", "s.yaml", "lidar", "="], ["sick", "ouster"]),
        (["run", "s.yaml", "lidar", "=", "ou"], ["ouster"]),
        (["run", "s.yaml", "lidar", "=", "sick", "sim"], ["sim=false", "sim=true"]),
        (["graph", "s.yaml", "lid"], ["lidar=sick", "lidar=ouster"]),
        (["validate", "s.yaml", "lidar", "=", "o"], ["ouster"]),
        (["run", "missing.yaml", ""], []),
    ],
)
def test_words_are_completed(folder: Path, words: list[str], offered: list[str]) -> None:
    arguments = "{sim: false, lidar: {choices: [sick, ouster]}, rate: 5.0}"
    write_files({"s.yaml": f"system: s\narguments: {arguments}\n"})
    assert complete(*words) == offered


@pytest.fixture
def robot(
    tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> Iterator[None]:
    """What a running system provides: its lock, and its view of the graph."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path_factory.mktemp("run")))
    view: GraphView = {
        "node": (("/control/arm", ()), ("/planning/planner", ()), ("/planning/_hidden", ())),
        "topic": (("/sensor_data", ("std_msgs/msg/String",)), ("/status", ())),
        "service": (("/plan", ()),),
        "action": (("/navigate", ()), ("/navigate_back", ())),
    }
    with hold_instance_lock("/fleet/robot"):
        server = QuerySocket(
            "/fleet/robot", {GraphQuery: lambda _: GraphAnswer(view)}, lambda _: None
        )
        yield
        server.close(10.0)


@pytest.mark.usefixtures("robot")
def test_names_of_a_running_system_are_completed() -> None:
    for words, offered in (
        (("topic", "echo", "/se"), "/sensor_data"),
        (("lifecycle", "set", "pl"), "planner"),
        (("lifecycle", "set", "planner", "act"), "activate"),
    ):
        while complete(*words) != [offered]:
            pass  # again: this process may have had no turn to respond in time


@pytest.mark.usefixtures("robot")
@pytest.mark.parametrize(
    ("complete_names", "typed", "offered"),
    [
        (complete_node, "", ["/control/arm", "/planning/planner"]),
        (complete_node, "/pl", ["/planning/planner"]),
        (complete_node, "a", ["arm"]),
        (complete_node, "/planning/_", ["/planning/_hidden"]),
        (complete_topic, "s", ["sensor_data", "status"]),
        (complete_topic, "/x", []),
        (complete_service, "/", ["/plan"]),
        (complete_action, "/navigate_", ["/navigate_back"]),
        (complete_running_system, "", ["robot"]),
        (complete_running_system, "/f", ["/fleet/robot"]),
        (complete_rule, "RC202", ["RC202"]),
        (complete_rule, "unknown-node-", ["unknown-node-type"]),
        (complete_type, "std_srvs/srv/E", ["std_srvs/srv/Empty"]),
        (complete_message_type, "std_srvs/srv/E", []),
    ],
)
def test_names(
    complete_names: Complete, typed: str, offered: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(completion, "WITHIN_S", 60.0)
    monkeypatch.setattr(local_queries, "RESPONSE_S", 60.0)
    assert complete_names(typed) == offered


def test_a_failure_or_no_system_completes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    assert complete_topic("/") == complete_node("") == []

    @silent
    def broken(incomplete: str) -> list[str]:
        raise RuntimeError(incomplete)

    assert broken("x") == []


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("", ["deep/", "here.yaml"]),
        ("./h", ["./here.yaml"]),
        ("de", ["deep/"]),
        ("deep/", ["deep/inner.yml"]),
        ("deep/in", ["deep/inner.yml"]),
        ("deep/x", []),
    ],
)
def test_paths_of_systems_are_completed(typed: str, offered: list[str], folder: Path) -> None:
    write_files(dict.fromkeys(("here.yaml", "notes.txt", ".hidden.yaml", "deep/inner.yml"), ""))
    examples = complete_system(typed)[: -len(offered) or None] if typed == "" else []
    assert complete_system(typed) == [*examples, *offered]
