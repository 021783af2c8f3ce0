"""Answers of a running system of another version are not used."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from composer.client.systems import local_queries
from composer.client.systems.local_endpoints import local_endpoints
from composer.model import PortKind
from composer.model.qos import PRESETS
from composer.plan.drift import ObservedEndpoint
from composer.runtime.process.instance_lock import hold_instance_lock
from composer.runtime.process.query_socket import (
    ACTION,
    ENDPOINTS,
    GRAPH,
    NODE,
    NODES,
    PARAMETERS,
    STATUS,
    TOPIC,
    QuerySocket,
)

LIMIT_S = 60.0
LIMITS = ("local_graph.RESPONSE_S", "local_queries.RESPONSE_S", "local_endpoints._RESPONSE_S")
VIEW = {"node": [["/a", []]], "topic": [], "service": [], "action": []}


@pytest.fixture
def answers(
    tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> Iterator[dict[str, Any]]:
    """The answers of the running system /robot, by query."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path_factory.mktemp("run")))
    for limit in LIMITS:  # what takes longer is not an answer, which this is not about
        monkeypatch.setattr(f"composer.client.systems.{limit}", LIMIT_S)
    found: dict[str, Any] = dict.fromkeys((NODE, TOPIC, ACTION, STATUS, ENDPOINTS))
    found |= {GRAPH: VIEW, NODES: ["/a"], PARAMETERS: {}}
    with hold_instance_lock("/robot"):
        queries = {name: lambda _, name=name: found[name] for name in found}
        server = QuerySocket("/robot", queries, lambda error: pytest.fail(str(error)))
        yield found
        server.close(LIMIT_S)


@pytest.mark.parametrize(
    "shape",
    [None, 3, "text", [], [1], [["a"]], {}, {"/a": 1}, {"/a": [[{}, 1]]}, {"/a": [{"x": 1}]}],
)
def test_answers_of_another_shape_are_none(answers: dict[str, Any], shape: Any) -> None:
    for query in (NODE, TOPIC, ACTION, STATUS, PARAMETERS):
        answers[query] = shape
    assert not local_queries.local_parameters("a", LIMIT_S)
    assert local_queries.local_report("robot", LIMIT_S) is None
    assert local_queries.local_reports(LIMIT_S) is None
    assert local_queries.local_state("a", LIMIT_S) is None
    assert local_queries.local_topic("a", LIMIT_S) is None
    assert local_queries.local_action("a", LIMIT_S) is None
    local_queries.local_node("a", LIMIT_S, hidden=False)
    local_queries.all_local_parameters(LIMIT_S, hidden=False)


@pytest.mark.parametrize("shape", [None, 3, "text", [1], [["/a"]], {"node": 1}, {}])
def test_a_graph_of_another_shape_is_none(answers: dict[str, Any], shape: Any) -> None:
    answers[GRAPH] = answers[NODES] = shape
    assert local_queries.local_node("a", LIMIT_S, hidden=False) is None
    assert local_queries.local_reports(LIMIT_S) is None
    assert local_queries.all_local_parameters(LIMIT_S, hidden=False) is None


def test_a_name_of_two_nodes_is_left_to_the_graph(answers: dict[str, Any]) -> None:
    facts = {
        "name": "p",
        "type": "double",
        "description": "",
        "constraints": "",
        "read_only": False,
    }
    facts |= {"minimum": None, "maximum": None, "step": None}
    answers[PARAMETERS] = {"/x/a": [[facts, 1.5]]}
    answers[NODES] = ["/x/a", "/b"]
    found = local_queries.local_parameters("a", LIMIT_S)
    assert found is not None
    assert found.node == "/x/a"
    assert found.values(["p"]) == {"p": 1.5}
    answers[NODES] = ["/x/a", "/y/a"]
    assert local_queries.local_parameters("a", LIMIT_S) is None
    assert local_queries.local_parameters("/x/a", LIMIT_S) is not None


def test_endpoints_are_those_that_were_sent(answers: dict[str, Any]) -> None:
    profile = PRESETS["sensor_data"]
    ends = (
        ObservedEndpoint(PortKind.PUBLISHER, "/scan", "sensor_msgs/msg/LaserScan", profile),
        ObservedEndpoint(PortKind.ACTION_SERVER, "/drive", "some_msgs/action/Drive"),
    )
    answer = {"endpoints": {"/a": [end.plain() for end in ends]}, "nodes": ["/a", "/a"]}
    answers[ENDPOINTS] = answer
    assert local_endpoints() == ({"/a": ends}, ["/a", "/a"])


@pytest.mark.parametrize(
    "end",
    [
        None,
        "text",
        [],
        ["publisher", "/scan", "x/msg/Y"],
        ["nothing", "/scan", "x/msg/Y", None],
        ["publisher", "/scan", "x/msg/Y", ["keep_last"]],
        ["publisher", "/scan", "x/msg/Y", [3] * 8],
    ],
)
def test_endpoints_of_another_shape_are_none(answers: dict[str, Any], end: Any) -> None:
    answers[ENDPOINTS] = {"endpoints": {"/a": [end]}, "nodes": ["/a"]}
    assert local_endpoints() is None
