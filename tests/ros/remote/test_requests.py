"""A request that is sent once waits until its server has discovered the client."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Iterator

import pytest
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.srv import GetParameters

from composer.client.requests import wait_until_known
from composer.client.session import Deadline, Session
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
