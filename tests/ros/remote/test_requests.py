"""When requests are sent, and which nodes depend on those of a lifecycle request."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.srv import GetParameters

from composer.client.requests import wait_until_known
from composer.client.session import Deadline, Session
from composer.client.systems.lifecycle_batch import active_dependents, inactive_dependents, lowered
from composer.runtime.protocol.reports import NodeReport
from tests.ros.support.commands import hand_written
from tests.ros.support.in_process import wait_until

SERVICE = "/other/arm/change_state"


@pytest.fixture
def process(ros_domain_id: int) -> Iterator[subprocess.Popen[str]]:
    with hand_written("hand_written.py") as process:
        yield process


def test_a_server_knows_the_clients_of_a_session_once_its_process_responds(
    process: subprocess.Popen[str],
) -> None:
    with Session() as session:
        node = session.node
        earlier = (
            node.create_client(ChangeState, SERVICE),
            node.create_client(GetParameters, "/other/arm/get_parameters"),
        )
        wait_until(lambda: all(client.service_is_ready() for client in earlier), "the services")
        process.send_signal(signal.SIGSTOP)
        client = node.create_client(ChangeState, SERVICE)
        wait_until(client.service_is_ready, "the server, which cannot have discovered the client")
        assert not wait_until_known(session, SERVICE, Deadline(20.0))
        process.send_signal(signal.SIGCONT)
        wait_until(lambda: wait_until_known(session, SERVICE, Deadline(20.0)), "the server")


def test_a_server_without_parameter_services_is_called_at_once(ros_domain_id: int) -> None:
    with Session() as session:
        assert not wait_until_known(session, "/nothing", Deadline(float("inf")))


PROCESS_LIST = "import sys, composer.client.systems.process_list; sys.exit('numpy' in sys.modules)"


def test_listing_processes_does_not_import_numpy() -> None:
    """It would take longer than the rest of the command."""
    assert subprocess.run([sys.executable, "-c", PROCESS_LIST], check=False).returncode == 0


def robot(states: str) -> list[NodeReport]:
    """Return nodes in the order of the bring-up; ``states`` has a letter for each."""
    names = {"u": "unconfigured", "i": "inactive", "a": "active", "f": "finalized"}
    sensor, planner, logger, motor, camera = (names[letter] for letter in states)
    return [
        NodeReport("/sensor", sensor, state=sensor),
        NodeReport("/planner", planner, depends_on={"/sensor": "active"}, state=planner),
        NodeReport("/logger", logger, depends_on={"/planner": "inactive"}, state=logger),
        NodeReport("/motor", motor, depends_on={"/planner": "active"}, state=motor),
        NodeReport("/camera", camera, state=camera),
    ]


def test_only_goals_below_the_state_take_a_node_down() -> None:
    goals = {"/sensor": "inactive", "/planner": "active", "/motor": "finalized", "/arm": "inactive"}
    assert lowered(robot("aiaua"), goals) == {"/sensor": "inactive", "/motor": "finalized"}


ACTIVE_DEPENDENTS = [
    ("aaaaa", {"/sensor": "inactive"}, "/motor /planner"),  # an inactive planner is enough
    ("aaaaa", {"/planner": "inactive"}, "/motor"),  # for the logger
    ("aaaaa", {"/planner": "unconfigured"}, "/motor /logger"),
    ("aaaaa", {"/planner": "finalized"}, "/motor /logger"),
    ("aiaia", {"/sensor": "inactive"}, ""),
    ("aaaaa", {"/planner": "inactive", "/motor": "inactive"}, ""),
]


@pytest.mark.parametrize(("states", "goals", "dependents"), ACTIVE_DEPENDENTS)
def test_active_dependents_come_in_reverse_order(
    states: str, goals: dict[str, str], dependents: str
) -> None:
    assert active_dependents(robot(states), goals) == tuple(dependents.split())


INACTIVE_DEPENDENTS = [
    ("iiaii", {"/sensor": "active"}, "/planner /motor"),
    ("iiiii", {"/planner": "active"}, "/logger /motor"),
    ("auiii", {"/planner": "inactive"}, "/logger"),
    ("iiaua", {"/sensor": "active"}, "/planner"),
    ("aaaai", {"/camera": "active"}, ""),
]


@pytest.mark.parametrize(("states", "goals", "dependents"), INACTIVE_DEPENDENTS)
def test_inactive_dependents_come_in_order_once_all_they_need_is_up(
    states: str, goals: dict[str, str], dependents: str
) -> None:
    assert inactive_dependents(robot(states), goals) == tuple(dependents.split())
