"""A session of several threads: what it notices of the graph, and its subscriptions."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import pytest
from composer_interfaces.action import Navigate
from rclpy.qos import QoSProfile
from std_msgs.msg import String

from composer.client.calls import GoalClient
from composer.client.session import Deadline, Session
from composer.client.shared_session import InvalidHandle, SharedSession
from tests.ros.support.in_process import Peer, wait_until

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
            self._count = len(self._session.graph.topic("/text", ()).subscriptions)
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
