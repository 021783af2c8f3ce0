"""Requests to nodes and their dependents, and sessions that several threads share."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from typing import Any

import pytest
from composer_interfaces.action import Navigate
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.srv import GetParameters
from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import String

from composer.client.calls import GoalClient
from composer.client.lifecycle import active_dependents, inactive_dependents, lowered
from composer.client.parameters import UNSET, LoggerLevels
from composer.client.requests import wait_until_known
from composer.client.session import Deadline, Session
from composer.client.shared_session import InvalidHandle, SharedSession
from composer.runtime.protocol.reports import NodeReport
from composer.runtime.ros.endpoints import topic_info
from tests.ros.support.commands import hand_written
from tests.ros.support.in_process import Peer, wait_until

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


def test_a_silent_node_does_not_hide_the_log_levels_of_others(peer: Peer) -> None:
    name = peer.join("talking", LoggingNode).get_fully_qualified_name()
    context = Context()
    context.init([])
    silent = LoggingNode("a_silent", context=context)  # nothing spins it
    try:
        with Session() as session:
            service = "/get_logger_levels"
            known = session.graph.services
            wait_until(lambda: sum(each.endswith(service) for each, _ in known()) == 2, service)
            levels = LoggerLevels(session, Deadline(5.0)).all()
    finally:
        silent.destroy_node()
        context.try_shutdown()
    assert levels == {"/a_silent": None, name: UNSET}


class LoggingNode(Node):
    def __init__(self, name: str, **arguments: Any) -> None:
        super().__init__(name, enable_logger_service=True, **arguments)


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


#: States and goals, and the dependents that are still active.
ACTIVE_DEPENDENTS = [
    ("aaaaa", {"/sensor": "inactive"}, "/motor /planner"),  # an inactive planner is enough
    ("aaaaa", {"/planner": "inactive"}, "/motor"),  # for the logger
    ("aaaaa", {"/planner": "unconfigured"}, "/motor /logger"),
    ("aaaaa", {"/planner": "finalized"}, "/motor /logger"),
    ("aiaia", {"/sensor": "inactive"}, ""),
    ("aaaaa", {"/planner": "inactive", "/motor": "inactive"}, ""),
]
#: States and goals, and the dependents that may follow.
INACTIVE_DEPENDENTS = [
    ("iiaii", {"/sensor": "active"}, "/planner /motor"),
    ("iiiii", {"/planner": "active"}, "/logger /motor"),
    ("auiii", {"/planner": "inactive"}, "/logger"),
    ("iiaua", {"/sensor": "active"}, "/planner"),
    ("aaaai", {"/camera": "active"}, ""),
]


def test_dependents_come_in_order_once_all_they_need_is_up_and_active_ones_in_reverse() -> None:
    for states, goals, dependents in ACTIVE_DEPENDENTS:
        assert active_dependents(robot(states), goals) == tuple(dependents.split())
    for states, goals, dependents in INACTIVE_DEPENDENTS:
        assert inactive_dependents(robot(states), goals) == tuple(dependents.split())


QOS = QoSProfile(depth=10)
TEXTS = ["one", "two", "three"]


@pytest.fixture
def session(peer: Peer) -> Iterator[SharedSession]:
    with SharedSession() as session:
        name = (peer.node.get_name(), "/")
        wait_until(lambda: name in session.graph.nodes(), "the peer is discovered")
        yield session


class Observer:
    """Queries a topic only after changes of the graph, so that it depends on each of them."""

    def __init__(self, session: SharedSession) -> None:
        self._session = session
        self._number = 0
        self._count = 0

    def sees(self, count: int) -> bool:
        """Return whether the topic has this number of subscriptions."""
        number = self._session.changes.number()
        if number != self._number:
            self._number = number
            self._count = len(topic_info(self._session.graph.node, "/text", ()).subscriptions)
        return self._count == count


def test_each_change_of_the_graph_is_noticed(session: SharedSession, peer: Peer) -> None:
    """Also one that changes no name: another endpoint of a topic that the node has already."""
    observer = Observer(session)
    node = peer.node
    for _ in range(10):
        for count in (1, 2):
            node.create_subscription(String, "/text", print, QOS)
            wait_until(partial(observer.sees, count), f"{count} subscriptions")
        for count in (1, 0):
            node.destroy_subscription(next(node.subscriptions))
            wait_until(partial(observer.sees, count), f"{count} subscriptions")


def test_a_subscription_gets_messages_in_order_whatever_its_callback_raises(
    session: SharedSession, peer: Peer, caplog: pytest.LogCaptureFixture
) -> None:
    publisher = peer.node.create_publisher(String, "/text", QOS)
    received: list[str] = []

    def on_message(message: String) -> None:
        received.append(message.data)
        if message.data == TEXTS[1]:
            raise ValueError("not this one")

    subscription = session.node.create_subscription(String, "/text", on_message, QOS)
    wait_until(lambda: publisher.get_subscription_count() == 1, "the subscription")
    for text in TEXTS:
        publisher.publish(String(data=text))
    wait_until(lambda: len(received) == len(TEXTS), "the messages")
    wait_until(lambda: caplog.text.count("ValueError: not this one") == 1, "the log")
    session.node.destroy_subscription(subscription)
    wait_until(lambda: publisher.get_subscription_count() == 0, "the end of the subscription")
    assert received == TEXTS


def test_an_action_client_may_end_when_the_executor_is_about_to_wait() -> None:
    """It is then still in the list of what the executor waits for."""
    with Session() as session:
        client = GoalClient(session.node, Navigate, "/navigate")
        client.destroy()
        session.node.add_waitable(client)
        with pytest.raises(InvalidHandle):
            session.spin_once(Deadline(0.0))
        session.node.remove_waitable(client)
