"""What commands read of the systems on this computer, without joining the ROS graph."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from composer.client.systems import local_queries
from composer.model import PortKind
from composer.model.qos import PRESETS
from composer.plan.drift import ObservedEndpoint
from composer.runtime.process.instance_lock import hold_instance_lock
from composer.runtime.process.query_socket import QuerySocket
from composer.runtime.protocol.reports import NodeReport, SystemReport
from composer.runtime.protocol.requests import (
    DetailsAnswer,
    DetailsQuery,
    EndpointsAnswer,
    EndpointsQuery,
    GraphAnswer,
    GraphQuery,
    NodesAnswer,
    NodesQuery,
    ParameterDescription,
    ParametersAnswer,
    ParametersQuery,
    StatusQuery,
)

LIMIT_S = 60.0
VIEW = {"node": (("/a", ()),), "topic": (), "service": (), "action": ()}
SPEED = ParameterDescription("p", "double", "", "", False, None, None, None)
NODE = {"name": "/a", "services": [["/ask", ["x/srv/Ask"]]]}
REPORT = SystemReport("robot", "running", (NodeReport("/a", "active", state="active"),), "vm", "7")


@pytest.fixture
def answers(
    tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> Iterator[dict[Any, Any]]:
    """The answers of the running system /robot, by query."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path_factory.mktemp("run")))
    for limit in ("RESPONSE_S", "ENDPOINTS_S"):  # what takes longer is not an answer
        monkeypatch.setattr(local_queries, limit, LIMIT_S)
    found: dict[Any, Any] = {EndpointsQuery: None}
    found |= {GraphQuery: GraphAnswer(VIEW), NodesQuery: NodesAnswer(("/a",))}
    found |= {DetailsQuery: DetailsAnswer(NODE)}
    found |= {ParametersQuery: ParametersAnswer({}), StatusQuery: REPORT}
    with hold_instance_lock("/robot"):
        queries = {kind: lambda _, kind=kind: found[kind] for kind in found}
        server = QuerySocket("/robot", queries, lambda error: pytest.fail(str(error)))
        yield found
        server.close(LIMIT_S)


def all_answers() -> list[Any]:
    return [
        local_queries.local_names("node", LIMIT_S),
        local_queries.local_details("node", "a", LIMIT_S),
        local_queries.local_details("topic", "a", LIMIT_S),
        local_queries.local_parameters("a", LIMIT_S),
        local_queries.local_report("robot", LIMIT_S),
        local_queries.local_reports(LIMIT_S),
        local_queries.local_state("a", LIMIT_S),
        local_queries.local_endpoints(),
    ]


def test_answers_are_those_that_were_sent_or_left_to_the_graph(answers: dict[Any, Any]) -> None:
    ends = (
        ObservedEndpoint(
            PortKind.PUBLISHER, "/scan", "sensor_msgs/msg/LaserScan", PRESETS["sensor_data"]
        ),
        ObservedEndpoint(PortKind.ACTION_SERVER, "/drive", "some_msgs/action/Drive"),
    )
    answers[EndpointsQuery] = EndpointsAnswer({"/a": ends}, ("/a", "/a"))
    assert local_queries.local_endpoints() == ({"/a": ends}, ["/a", "/a"])
    assert local_queries.local_state("a", LIMIT_S) == "active"
    assert local_queries.local_details("node", "a", LIMIT_S) == NODE
    answers.update(dict.fromkeys(answers))  # the system is not certain
    assert all_answers() == [None] * 8


def test_a_name_of_two_nodes_is_left_to_the_graph(answers: dict[Any, Any]) -> None:
    answers[ParametersQuery] = ParametersAnswer({"/x/a": ((SPEED, 1.5),)})
    answers[NodesQuery] = NodesAnswer(("/x/a", "/b"))
    found = local_queries.local_parameters("a", LIMIT_S)
    assert found is not None
    assert found.node == "/x/a"
    assert found.values(["p"]) == {"p": 1.5}
    answers[NodesQuery] = NodesAnswer(("/x/a", "/y/a"))
    assert local_queries.local_parameters("a", LIMIT_S) is None
    assert local_queries.local_parameters("/x/a", LIMIT_S) is not None
