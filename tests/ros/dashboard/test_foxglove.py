"""The published client of the Foxglove protocol, with a running system and a hand-written node.

Requires Node.js and ``npm ci --prefix tests/foxglove``.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import pytest
from std_msgs.msg import String
from std_srvs.srv import Trigger

from tests.programs import require_package
from tests.ros.support.dashboard import Dashboard, dashboard
from tests.ros.support.foxglove import FOLDER, FoxgloveClient, foxglove
from tests.ros.support.in_process import Peer, wait_until

PLANNER, CONTROLLER = "/planning/planner", "/control/motor_controller"


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
            "services",
        }
        assert info["supportedEncodings"] == ["cdr"]
        client.has("/sensor_data")
        client.do("subscribe", topic="/sensor_data")
        assert client.message("/sensor_data")["value"]["header"]["frame_id"] == "odom"


def test_every_schema_can_be_read(client: FoxgloveClient) -> None:
    client.until("advertiseServices", lambda found: _named(found, "/plan_trajectory"))

    def are_many_checked() -> bool:
        """Check the schemas that are advertised by now; others are discovered later."""
        client.do("check")
        with suppress(AssertionError):
            return bool(client.until("checked", lambda count: count > 40, within_s=0.5))
        return False

    wait_until(are_many_checked, "many schemas")


def _named(found: list[dict[str, Any]], name: str) -> bool:
    return any(item["name"] == name for item in found)


def test_messages_are_those_that_were_published(client: FoxgloveClient) -> None:
    client.do("subscribe", topic="/lab/count")
    values = [-1]
    # The node counts what it sends; a process that does not run for a moment misses some.
    while values[-20:] != list(range(values[-1] - 19, values[-1] + 1)):
        message = client.message("/lab/count", lambda value: value["data"] > values[-1])
        values.append(message["value"]["data"])
    assert abs(message["timestamp"] / 1e9 - time.time()) < 10
    client.do("unsubscribe", subscription=message["subscription"])


def test_messages_from_before_the_subscription(client: FoxgloveClient) -> None:
    client.do("subscribe", topic="/lab/text")
    assert client.message("/lab/text")["value"] == {"data": "x" * 200}
    client.do("subscribe", topic="/rosout")
    assert client.message("/rosout", lambda value: value["msg"])["value"]["level"] >= 10


def test_a_topic_that_appears_later_and_goes(client: FoxgloveClient, peer: Peer) -> None:
    publisher = peer.node.create_publisher(String, "/lab/late", 10)
    channel = client.has("/lab/late")
    first = _received(client, publisher, "first")
    client.do("unsubscribe", subscription=first)
    wait_until(lambda: not publisher.get_subscription_count(), "the end of the subscription")
    publisher.publish(String(data="missed"))
    third = _received(client, publisher, "third")
    assert third != first
    messages = [data for event, data in client.events if event == "message"]
    received = [item["value"]["data"] for item in messages if item["topic"] == "/lab/late"]
    assert received == ["first", "third"]
    client.do("unsubscribe", subscription=third)
    peer.run(lambda: peer.node.destroy_publisher(publisher))
    client.until("unadvertise", lambda ids: channel in ids)


def _received(client: FoxgloveClient, publisher: Any, text: str) -> int:
    """Publish a message for the client; return the subscription that it has got it by."""
    client.do("subscribe", topic="/lab/late")
    wait_until(publisher.get_subscription_count, "the subscription")
    publisher.publish(String(data=text))
    message = client.message("/lab/late", lambda value: value["data"] == text)
    return int(message["subscription"])


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


def test_services_are_called(client: FoxgloveClient) -> None:
    assert _called(client, "/lab/add", data=True) == {"success": True, "message": "switched"}
    state = _called(client, f"{PLANNER}/get_state")
    assert state["current_state"] == {"id": 3, "label": "active"}


def _called(client: FoxgloveClient, name: str, **request: Any) -> Any:
    """Call a service; again, since a server may discover the client later than that it."""
    client.until("advertiseServices", lambda found: _named(found, name))
    responses: list[Any] = []

    def is_answered() -> bool:
        client.do("call", name=name, request=request)
        with suppress(AssertionError):
            responses.append(client.until("response", lambda data: data["name"] == name, 2.0))
        return bool(responses)

    wait_until(is_answered, f"a response of {name}")
    return responses[0]["value"]


def test_a_call_that_fails(client: FoxgloveClient, peer: Peer) -> None:
    service = peer.node.create_service(Trigger, "/lab/brief", lambda _, response: response)
    found = client.until("advertiseServices", lambda found: _named(found, "/lab/brief"))
    number = next(item["id"] for item in found if item["name"] == "/lab/brief")
    assert _called(client, "/lab/brief") == {"success": False, "message": ""}
    peer.run(lambda: peer.node.destroy_service(service))
    client.until("unadvertiseServices", lambda ids: number in ids)
    client.do("call", name="/lab/brief", request={})
    failure = client.until("serviceCallFailure", lambda data: data["serviceId"] == number)
    assert failure["message"] == f"there is no service {number}"
    assert _called(client, "/lab/add", data=True)["success"]


def test_a_read_only_dashboard_only_shows(pipeline: Any) -> None:
    with dashboard("--read-only") as server, foxglove(server.address) as client:
        info = client.until("serverInfo")
        assert not {"clientPublish", "services"} & set(info["capabilities"])
        client.has("/sensor_data")
        client.do("advertise", topic="/lab/in", schemaName="std_msgs/msg/String")
        client.until("status", lambda data: "publishing is not possible" in data["message"])
