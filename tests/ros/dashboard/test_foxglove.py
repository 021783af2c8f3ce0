"""The published client of the Foxglove protocol, with a running system and a hand-written node.

Requires Node.js and ``npm ci --prefix tests/foxglove``.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import pytest

from tests.programs import require_package
from tests.ros.support.commands import output_of
from tests.ros.support.dashboard import Dashboard, dashboard
from tests.ros.support.foxglove import FOLDER, FoxgloveClient, foxglove

PLANNER, CONTROLLER = "/planning/planner", "/control/motor_controller"
SPEED = f"{PLANNER}.max_velocity"


@pytest.fixture(scope="module", autouse=True)
def packages() -> None:
    require_package(FOLDER, "@foxglove/ws-protocol")


@pytest.fixture(scope="module")
def client(server: Dashboard) -> Iterator[FoxgloveClient]:
    with foxglove(server.address) as connected:
        connected.has("/sensor_data")
        connected.has("/lab/count")
        connected.has("/lab/in")
        yield connected


@pytest.mark.parametrize("subprotocol", ["foxglove.websocket.v1", "foxglove.sdk.v1"])
def test_both_names_of_the_protocol(server: Dashboard, subprotocol: str) -> None:
    with foxglove(server.address, subprotocol) as client:
        assert client.until("open") == subprotocol
        info = client.until("serverInfo")
        assert set(info["capabilities"]) == {
            "clientPublish",
            "parameters",
            "parametersSubscribe",
            "services",
            "connectionGraph",
        }
        assert info["supportedEncodings"] == ["cdr"]
        client.has("/sensor_data")
        client.do("subscribe", topic="/sensor_data")
        assert client.message("/sensor_data")["value"]["header"]["frame_id"] == "odom"


def test_every_schema_can_be_read(client: FoxgloveClient) -> None:
    client.until("advertiseServices", lambda found: _named(found, "/plan_trajectory"))
    client.do("check")
    assert client.until("checked") > 40


def _named(found: list[dict[str, Any]], name: str) -> bool:
    return any(item["name"] == name for item in found)


def test_messages_are_those_that_were_published(client: FoxgloveClient) -> None:
    client.do("subscribe", topic="/lab/count")
    values = [-1]
    for _ in range(20):
        message = client.message("/lab/count", lambda value: value["data"] > values[-1])
        values.append(message["value"]["data"])
    # The node counts what it sends.
    assert values[1:] == list(range(values[1], values[1] + 20))
    assert abs(message["timestamp"] / 1e9 - time.time()) < 10
    client.do("unsubscribe", subscription=message["subscription"])


def test_messages_from_before_the_subscription(client: FoxgloveClient) -> None:
    client.do("subscribe", topic="/lab/text")
    assert client.message("/lab/text")["value"] == {"data": "x" * 200}
    client.do("subscribe", topic="/rosout")
    assert client.message("/rosout", lambda value: value["msg"])["value"]["level"] >= 10


def test_a_message_of_the_client_is_published(client: FoxgloveClient) -> None:
    client.do("advertise", topic="/lab/in", schemaName="std_msgs/String")
    channel = client.until("advertised")
    client.do("subscribe", topic="/lab/received")
    message = {"data": "from outside"}
    for _ in range(40):  # a message is lost if the subscription has not matched yet
        client.do("publish", channel=channel, topic="/lab/in", message=message)
        with suppress(AssertionError):
            received = client.message("/lab/received", lambda value: value == message, within_s=0.5)
            assert received["value"] == message
            break
    else:
        pytest.fail("the message has not arrived")


def test_parameters_are_set_and_followed(client: FoxgloveClient) -> None:
    client.do("get", names=[], id="all")
    everything = _parameters(client, "all")
    assert everything[SPEED] == {"name": SPEED, "value": 1, "type": "float64"}
    assert everything["/lab/talker.limits.reach"]["value"] == 1.0
    assert everything["/lab/talker.name"] == {"name": "/lab/talker.name", "value": "robot"}
    client.do("watch", names=[SPEED])
    client.do("set", parameters=[{"name": SPEED, "value": 2}], id="set")
    assert _parameters(client, "set")[SPEED]["value"] == 2
    client.until("parameterValues", lambda data: "id" not in data and data["parameters"])
    assert output_of("param", "get", PLANNER, "max_velocity").strip().endswith("2.0")
    client.do("set", parameters=[{"name": SPEED, "value": 1, "type": "float64"}], id="back")
    assert _parameters(client, "back")[SPEED]["value"] == 1


def test_a_refused_parameter_keeps_its_value(client: FoxgloveClient) -> None:
    client.do("set", parameters=[{"name": SPEED, "value": 1e9}], id="refused")
    assert _parameters(client, "refused")[SPEED]["value"] == 1
    status = client.until("status", lambda data: "max_velocity" in data["message"])
    assert status["level"] == 2
    client.do("get", names=["/missing.x", f"{PLANNER}.max_velocty"], id="missing")
    assert _parameters(client, "missing") == {}
    client.until("status", lambda data: "/missing" in data["message"])


def _parameters(client: FoxgloveClient, identifier: str) -> dict[str, Any]:
    data = client.until("parameterValues", lambda data: data.get("id") == identifier)
    return {item["name"]: item for item in data["parameters"]}


def test_services_are_called(client: FoxgloveClient) -> None:
    client.until("advertiseServices", lambda found: _named(found, "/lab/add"))
    client.do("call", name="/lab/add", request={"data": True})
    response = client.until("response", lambda data: data["name"] == "/lab/add")
    assert response["value"] == {"success": True, "message": "switched"}
    client.until("advertiseServices", lambda found: _named(found, f"{PLANNER}/get_state"))
    client.do("call", name=f"{PLANNER}/get_state", request={})
    state = client.until("response", lambda data: data["name"] == f"{PLANNER}/get_state")
    assert state["value"]["current_state"] == {"id": 3, "label": "active"}


def test_the_connection_graph(client: FoxgloveClient) -> None:
    client.do("graph")
    graph = client.until("connectionGraphUpdate")
    published = {item["name"]: item["publisherIds"] for item in graph["publishedTopics"]}
    subscribed = {item["name"]: item["subscriberIds"] for item in graph["subscribedTopics"]}
    services = {item["name"]: item["providerIds"] for item in graph["advertisedServices"]}
    assert published["/sensor_data"] == ["/perception/sensor_simulator"]
    assert subscribed["/sensor_data"] == [CONTROLLER, PLANNER]
    assert services["/plan_trajectory"] == [PLANNER]
    assert subscribed["/lab/in"] == ["/lab/talker"]


def test_what_is_gone_is_not_offered_any_more(client: FoxgloveClient) -> None:
    client.do("graph")
    output_of("lifecycle", "set", CONTROLLER, "deactivate")
    output_of("lifecycle", "set", CONTROLLER, "cleanup")
    client.until("connectionGraphUpdate", lambda data: "/motor_commands" in _changed(data))
    output_of("lifecycle", "set", CONTROLLER, "configure")
    output_of("lifecycle", "set", CONTROLLER, "activate")


def _changed(update: dict[str, Any]) -> list[str]:
    return [*update["removedTopics"], *(item["name"] for item in update["publishedTopics"])]


def test_a_read_only_dashboard_only_shows(pipeline: Any) -> None:
    with dashboard("--read-only") as server, foxglove(server.address) as client:
        info = client.until("serverInfo")
        assert not {"clientPublish", "services"} & set(info["capabilities"])
        client.has("/sensor_data")
        client.do("set", parameters=[{"name": SPEED, "value": 2}], id="x")
        client.do("advertise", topic="/lab/in", schemaName="std_msgs/msg/String")
        client.until("status", lambda data: "setting parameters" in data["message"])
        client.until("status", lambda data: "publishing is not possible" in data["message"])
        client.do("get", names=[SPEED], id="still")
        assert _parameters(client, "still")[SPEED]["value"] == 1
