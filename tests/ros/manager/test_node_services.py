"""Nodes without endpoints for tools, whose services are left to the manager node."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any

import pytest
from rcl_interfaces.msg import Log, ParameterEvent
from rclpy.lifecycle import LifecycleNode
from rclpy.parameter import Parameter

from composer.client.lifecycle import LifecycleClient, TransitionError
from composer.client.parameters import ParameterClient, ParameterRejectedError, names_by_node
from composer.client.session import Deadline, Session
from composer.client.snapshot import GraphObserver
from composer.plan.drift import ObservedNode
from composer.runtime.protocol.requests import CallNodes, NodeCall
from composer.runtime.ros.messages import to_plain
from composer.runtime.ros.service_requests import RequestService, read_answer, request_message
from tests.ros.support.in_process import Peer, RunningSystem, running, wait_until

LEAN = """
system: lean
introspection:
  {parameters: false, rosout: false, type_description: false, lifecycle_services: false}
nodes:
  talker:
    namespace: far
    parameters:
      speed: {type: double, default: 1.5, maximum: 5.0}
      label: {type: string, default: here}
    on_activate: {log: "here I am"}
  whole:
    introspection:
      {parameters: true, rosout: true, type_description: true, lifecycle_services: true}
    parameters: {size: {type: integer, default: 3}}
    on_activate: {log: "so am I"}
"""
TALKER = "/far/talker"


@pytest.fixture(scope="module")
def system(
    tmp_path_factory: pytest.TempPathFactory, shared_domain_id: int
) -> Iterator[RunningSystem]:
    with running(LEAN, tmp_path_factory.mktemp("lean")) as system:
        yield system


@pytest.fixture(scope="module")
def session(system: RunningSystem) -> Iterator[Session]:
    with Session() as session:
        yield session


def services_of(peer: Peer, name: str, namespace: str) -> set[str]:
    found = peer.node.get_service_names_and_types_by_node(name, namespace)
    return {service for service, _ in found}


def publishers_of(peer: Peer, topic: str) -> set[str]:
    return {info.node_name for info in peer.node.get_publishers_info_by_topic(topic)}


def test_disabled_endpoints_are_not_created(system: RunningSystem, peer: Peer) -> None:
    known = peer.node.get_fully_qualified_node_names
    wait_until(lambda: {"/whole", TALKER} <= set(known()), "both nodes")
    peer.listen(Log, "/rosout")
    peer.listen(ParameterEvent, "/parameter_events")
    expected = {"/whole/get_state", "/whole/get_type_description", "/whole/list_parameters"}
    wait_until(lambda: expected <= services_of(peer, "whole", "/"), "the services of a whole node")
    wait_until(lambda: peer.node.count_publishers("/far/talker/transition_event"), "the topic")
    assert services_of(peer, "talker", "/far") == set()
    for topic in ("/rosout", "/parameter_events"):
        wait_until(lambda topic=topic: "whole" in publishers_of(peer, topic), f"{topic} of a node")
        assert "talker" not in publishers_of(peer, topic)
    assert {"here I am", "so am I"} <= set(system.log())


def test_the_manager_answers_requests_to_services_of_nodes(
    system: RunningSystem, peer: Peer
) -> None:
    def response(service: str, **fields: Any) -> Any:
        request = CallNodes((NodeCall(service, fields),))
        message = request_message(request)
        answer = peer.call(RequestService, "/lean/manager/request", message)
        (found,) = read_answer(answer, request).responses
        return found

    values = response(f"{TALKER}/get_parameters", names=["speed", "missing"])["values"]
    assert values == []  # as rclpy does
    types = response(f"{TALKER}/get_parameter_types", names=["speed", "label"])["types"]
    assert types == [3, 4]
    changes = [
        to_plain(Parameter("speed", value=2.5).to_parameter_msg()),
        to_plain(Parameter("missing", value=2.5).to_parameter_msg()),
    ]
    results = response(f"{TALKER}/set_parameters", parameters=changes)["results"]
    assert [result["successful"] for result in results] == [True, False]
    together = response(f"{TALKER}/set_parameters_atomically", parameters=changes)["result"]
    assert not together["successful"]
    assert response("/missing/get_state") is None
    assert response(f"{TALKER}/reboot") is None
    assert response(f"{TALKER}/get_parameters", names=3) is None
    refused = response(f"{TALKER}/change_state", transition={"label": "activate"})
    assert refused == {"success": False}


def test_clients_reach_such_nodes(session: Session) -> None:
    client = LifecycleClient(session, Deadline(20.0))
    assert client.find("talker") == TALKER
    assert set(client.nodes()) >= {TALKER, "/whole"}
    assert client.states([TALKER, "/whole"]) == {TALKER: "active", "/whole": "active"}
    with pytest.raises(TransitionError, match="'configure' is not possible"):
        client.change_state(TALKER, "configure")
    assert str(client.go_to_state(TALKER, "unconfigured")) == f"{TALKER}: active -> unconfigured"
    assert str(client.go_to_state(TALKER, "active")) == f"{TALKER}: unconfigured -> active"
    assert [legal.label for legal in client.transitions(TALKER)] == ["deactivate", "shutdown"]


def test_parameters_are_those_of_the_node(session: Session) -> None:
    deadline = Deadline(20.0)
    parameters = ParameterClient(session, deadline, "talker")
    assert {"label", "speed"} <= set(parameters.names())
    assert parameters.set({"speed": 4}) == {"speed": 4.0}
    assert parameters.values(["speed"]) == {"speed": 4.0}
    assert [item.name for item in parameters.describe(["speed", "label"])] == ["speed", "label"]
    with pytest.raises(ParameterRejectedError, match="rejected speed: "):
        parameters.set({"speed": 9.0})
    listed = names_by_node(session, deadline)
    assert {"label", "speed"} <= set(listed[TALKER] or ())
    assert "size" in (listed["/whole"] or ())
    assert "use_sim_time" in (listed["/lean/manager"] or ())
    assert not [name for name in listed["/lean/manager"] or () if "speed" in name]


def test_an_observer_reads_states_and_parameters(session: Session) -> None:
    names = (TALKER, "/whole", "/lean/manager")

    def responses() -> list[ObservedNode]:
        """Return the nodes that have responded; those that take two seconds are unknown."""
        snapshot = observer.snapshot(Deadline(20.0))
        found = [node for name in names if (node := snapshot.node(name)) is not None]
        return [node for node in found if node.state is not None and node.parameters]

    with GraphObserver(session) as observer:
        talker, whole, manager = wait_until(
            lambda: found if len(found := responses()) == len(names) else None, "all responses"
        )
    assert (talker.state, whole.state) == ("active", "active")
    speed = ParameterClient(session, Deadline(20.0), TALKER).values(["speed"])
    assert (talker.parameters or {})["speed"] == speed["speed"] > 1.0
    assert (whole.parameters or {})["size"] == 3
    assert not [name for name in manager.parameters or {} if "speed" in name]


def test_a_node_with_all_endpoints_has_those_of_a_lifecycle_node(
    system: RunningSystem, peer: Peer
) -> None:
    plain = LifecycleNode("plain", context=peer.context)

    def endpoints(name: str) -> dict[str, Counter[str]]:
        """Count the endpoints of a node by kind, with the name of the node replaced."""
        node = peer.node
        publishers = [
            topic
            for topic, _ in node.get_publisher_names_and_types_by_node(name, "/")
            for info in node.get_publishers_info_by_topic(topic)
            if info.node_name == name
        ]
        services = [
            service
            for service, _ in node.get_service_names_and_types_by_node(name, "/")
            for _ in range(node.count_services(service))
        ]
        found = {"publishers": publishers, "services": services}
        return {
            kind: Counter(item.replace(f"/{name}/", "~/") for item in names)
            for kind, names in found.items()
        }

    try:
        wait_until(lambda: {"plain", "whole"} <= set(peer.node.get_node_names()), "both nodes")
        expected = endpoints("plain")
        assert len(expected["services"]) == 12
        assert set(expected["services"].values()) == set(expected["publishers"].values()) == {1}
        wait_until(lambda: endpoints("whole") == expected, "all endpoints")
    finally:
        plain.destroy_node()
