"""The manager knows all endpoints, and leaves large answers to the services of ROS."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from std_msgs.msg import String

from composer.client.session import Session
from composer.client.systems.local_queries import local_endpoints, local_parameters
from composer.runtime.ros.endpoints import endpoints
from tests.ros.support.commands import Running, running
from tests.ros.support.in_process import wait_until
from tests.ros.support.system_process import write_system

SYSTEM = """
system: queried
nodes:
  talker:
    publishers: {out: {type: std_msgs/msg/String, topic: /talk, qos: sensor_data}}
    services: {ask: {type: std_srvs/srv/Trigger, service: /ask}}
  small: {parameters: {numbers: {type: integer_array, default: [1, 2]}, limit: 1.5}}
  large: {parameters: {numbers: {type: integer_array, default: [%s]}}}
"""
LIMIT_S = 10.0


@pytest.fixture(scope="module", autouse=True)
def system(shared_domain_id: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")  # as the system
        folder = tmp_path_factory.mktemp("queried")
        path = write_system(folder, SYSTEM % ", ".join(["7"] * 20_001))
        with running(folder / "log", str(path)) as started:
            started.wait_for("3 of 3 nodes active")
            yield started


def test_large_parameters_are_left_to_the_parameter_services() -> None:
    small = wait_until(lambda: local_parameters("/small", LIMIT_S), "an answer")
    assert small.values(["numbers", "limit"]) == {"numbers": [1, 2], "limit": 1.5}
    assert [item.type for item in small.describe(["limit"])] == ["double"]
    assert local_parameters("/large", LIMIT_S) is None
    assert local_parameters("/unknown", LIMIT_S) is None


def test_endpoints_are_those_that_another_process_discovers() -> None:
    with Session() as session:
        wait_until(lambda: dict(endpoints(session.graph)).keys() >= {"/talker", "/large"})

        def is_equal() -> bool:
            known, discovered = local_endpoints(), dict(endpoints(session.graph))
            return known is not None and known[0] == discovered

        wait_until(is_equal, "equal endpoints")


def test_endpoints_follow_the_changes_of_other_processes() -> None:
    def topics() -> set[str]:
        known = local_endpoints()
        ends = {} if known is None else known[0]
        return {end.name for of_node in ends.values() for end in of_node}

    with Session() as session:
        session.node.create_subscription(String, "/first", print, 1)
        wait_until(lambda: "/first" in topics(), "the first endpoint")
        assert "/second" not in topics()  # the answer that the manager keeps
        second = session.node.create_subscription(String, "/second", print, 1)
        wait_until(lambda: "/second" in topics(), "the second endpoint")
        session.node.destroy_subscription(second)
        wait_until(lambda: not {"/second"} & topics() and topics(), "the end of the endpoint")
        assert "/first" in topics()
    wait_until(lambda: not {"/first"} & topics() and topics(), "the end of the process")
