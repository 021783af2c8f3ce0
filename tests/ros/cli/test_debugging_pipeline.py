"""The commands for the ROS graph, and an access control policy, with a running pipeline."""

from __future__ import annotations

import json
import re
import signal
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from fnmatch import fnmatchcase
from itertools import product
from pathlib import Path
from xml.etree import ElementTree

import pytest
from std_msgs.msg import String

from composer.bridges.export.sros2 import SELF_TEST_TOPICS
from composer.client.graph_names import GraphNames
from composer.client.session import Deadline, Session
from composer.client.systems.local_queries import (
    local_details,
    local_names,
    local_parameters,
    local_report,
    local_reports,
)
from composer.runtime.intra_process import dds_flags
from composer.runtime.protocol.requests import KINDS
from tests.ros.support.commands import (
    PATIENCE_S,
    compose,
    hand_written,
    listed,
    output_of,
    repeated_until,
    running,
)
from tests.ros.support.in_process import Peer, wait_until


@pytest.fixture(scope="module", autouse=True)
def pipeline(tmp_path_factory: pytest.TempPathFactory, shared_domain_id: int) -> Iterator[None]:
    with running(tmp_path_factory.mktemp("pipeline") / "log.txt", "pipeline") as run:
        run.wait_for("3 of 3 nodes active")
        yield
        run.stop(signal.SIGTERM)


@pytest.fixture
def session(monkeypatch: pytest.MonkeyPatch) -> Iterator[Session]:
    """A session with the discovery range of the system."""
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    with Session() as session:
        yield session


#: Commands that a running system answers, and one that it leaves to the ROS graph.
ANSWERED = (
    ("ps",),
    ("ps", "pipeline"),
    ("lifecycle", "nodes"),
    ("lifecycle", "get", "planner"),
    ("node", "info", "planner"),
    ("node", "info", "planner", "--all"),
    ("topic", "info", "-v", "sensor_data"),
    ("topic", "info", "/rosout", "--json"),
    ("topic", "info", "/sensor_dat"),
    ("action", "info", "/navigate"),
    ("action", "info", "navigate", "--json"),
    ("action", "info", "/navigat"),
    ("param", "list"),
    ("param", "list", "planner", "--json"),
    ("param", "get", "motor_controller", "waypoints"),
    ("param", "describe", "planner", "max_velocity", "use_sim_time"),
    ("param", "dump", "/pipeline/manager"),
    ("param", "get", "planner", "max_velocit"),
)


def without_figures(text: str) -> str:
    """Hide rates, durations with their units, and the widths of columns, which depend on them."""
    return re.sub(" +", " ", re.sub(r"\d+\.?\d*( *\b(s|min)\b)?", " 0 ", text))


def outcomes(commands: Sequence[tuple[str, ...]]) -> dict[tuple[str, ...], tuple[str, str, int]]:
    """Return what the commands print, and their exit codes."""
    with ThreadPoolExecutor(4) as pool:
        finished = list(pool.map(lambda words: compose(*words), commands))
    return {
        words: (without_figures(done.stdout), done.stderr, done.returncode)
        for words, done in zip(commands, finished, strict=True)
    }


def test_a_running_system_answers_as_the_graph_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    until_s = time.monotonic() + PATIENCE_S
    left: Sequence[tuple[str, ...]] = ANSWERED
    # A process that is not scheduled for a moment is discovered late, or does not respond in time.
    while left:
        from_system = outcomes(left)
        with monkeypatch.context() as elsewhere:
            elsewhere.setenv("XDG_RUNTIME_DIR", str(tmp_path))  # as if the system ran elsewhere
            from_graph = outcomes(left)
        assert from_system == from_graph or time.monotonic() < until_s
        left = [words for words in left if from_system[words] != from_graph[words]]


def test_each_query_is_answered_without_the_graph(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A system that is busy for a moment does not answer in time; the commands use the graph."""
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    wait_until(lambda: local_reports(PATIENCE_S), "the reports")
    timed = wait_until(lambda: local_report("pipeline", PATIENCE_S, callbacks=True), "the report")
    planner = wait_until(lambda: local_parameters("planner", PATIENCE_S), "the parameters")
    assert planner.values(["max_velocity"]) == {"max_velocity": 1.0}
    for kind, name in (("node", "planner"), ("topic", "sensor_data"), ("action", "navigate")):
        wait_until(lambda kind=kind, name=name: local_details(kind, name, PATIENCE_S), name)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))  # as if the system ran elsewhere
    (system,) = json.loads(listed(('"callbacks"',), "ps", "--json"))["systems"]
    expected = {item["name"] for node in system["nodes"] for item in node["callbacks"]}
    assert {item.name for item in timed.callbacks} == expected


def test_log_levels() -> None:
    before = json.loads(listed(("planner", "motor_controller"), "log-level", "--json"))
    assert [level for node, level in before.items() if "manager" not in node] == ["info"] * 3
    assert compose("log-level", "planner", "debug").stdout.split()[1] == "debug"
    for node, level in (("planner", "debug"), ("motor_controller", "info")):
        assert compose("log-level", node).stdout.split()[1] == level
    assert "there is no node 'planer'" in compose("log-level", "planer").stderr


def test_the_manager_sees_the_same_graph_as_a_new_node(session: Session, peer: Peer) -> None:
    peer.node.create_publisher(String, "/of_an_external_node", 10)
    names = GraphNames(session, Deadline(PATIENCE_S))
    topic = ("/of_an_external_node", ("std_msgs/msg/String",))
    # A command of another test may still be there.
    wait_until(lambda: topic in (local_names("topic", PATIENCE_S) or ()), "the view of the manager")
    session.wait_for(lambda: topic in names.names("topic") or None, Deadline(PATIENCE_S))
    for kind, hidden in product(KINDS, (False, True)):
        wait_until(
            lambda kind=kind, hidden=hidden: (
                local_names(kind, PATIENCE_S, hidden=hidden) == names.names(kind, hidden=hidden)
            ),
            f"each {kind}",
        )
    nodes = wait_until(lambda: local_names("node", PATIENCE_S), "the nodes")
    assert "/pipeline/manager" in dict(nodes)


def test_a_killed_process_is_not_listed(session: Session) -> None:
    with hand_written("hand_written_forgetful.py"):
        wait_until(lambda: "/lab/forgetful" in dict(local_names("node", PATIENCE_S) or ()))
    assert "/lab/forgetful" not in dict(local_names("node", PATIENCE_S) or ())


def test_doctor_reports_no_problems() -> None:
    compatible = "all endpoints are compatible: "
    found = json.loads(listed((compatible,), "doctor", "--json"))
    assert [item for item in found if item["level"] in ("warning", "error")] == []
    (graph,) = (item["message"] for item in found if item["area"] == "graph")
    assert graph.startswith(compatible)


#: The sections of 'compose node info', and the rules of a policy.
RULES = {
    "publishers": ("topics", "publish"),
    "subscriptions": ("topics", "subscribe"),
    "services": ("services", "reply"),
    "clients": ("services", "request"),
    "action_servers": ("actions", "execute"),
    "action_clients": ("actions", "call"),
}
#: What is used at the start, with simulated time, or if another process runs the system.
UNUSED = [SELF_TEST_TOPICS, SELF_TEST_TOPICS, "/clock", "/pipeline/manager/_instance_*"]


def rules_of(profile: ElementTree.Element) -> dict[str, set[str]]:
    """Return the rules of a node's policy by the sections of 'compose node info'."""
    return {
        section: {
            element.text or ""
            for group in profile.findall(kind)
            if group.get(attribute) == "ALLOW"
            for element in group
        }
        for section, (kind, attribute) in RULES.items()
    }


def differences(rules: Mapping[str, set[str]], text: str) -> tuple[list[str], list[str]]:
    """Return the endpoints in the output of 'compose node info' without rules, and unused rules."""
    refused: list[str] = []
    unused: list[str] = []
    for section, patterns in rules.items():
        found = {item for item, _ in json.loads(text)[section] if "/_action/" not in item}
        refused += [item for item in found if not any(fnmatchcase(item, r) for r in patterns)]
        unused += [r for r in patterns if not any(fnmatchcase(item, r) for item in found)]
    return refused, unused


def test_the_policy_of_a_system_allows_every_endpoint_and_no_other() -> None:
    assert f"/{dds_flags.TEST_NODE}/*" == SELF_TEST_TOPICS
    root = ElementTree.fromstring(output_of("export", "sros2", "systems/pipeline.yaml"))
    profiles = {
        f"{item.get('ns', '').rstrip('/')}/{item.get('node')}": rules_of(item)
        for item in root.findall("enclaves/enclave/profiles/profile")
    }
    # A peer of another test may still be there.
    repeated_until(lambda text: text.split() == sorted(profiles), "node", "list")
    all_unused = []
    for name, rules in profiles.items():

        def is_complete(text: str) -> bool:
            return set(differences(rules, text)[1]) <= set(UNUSED)  # noqa: B023

        info = repeated_until(is_complete, "node", "info", name, "--json", "-a")
        refused, unused = differences(rules, info)
        assert refused == [], name
        all_unused += unused
    assert sorted(all_unused) == UNUSED
