"""Other processes that run the same system: only a live manager node counts, not a message."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import String
from std_srvs.srv import Trigger

from composer.runtime.host_options import HostOptions
from composer.runtime.manager import other_instances
from composer.runtime.manager.other_instances import is_older, parse_instance
from composer.runtime.protocol.codec import decode, encode
from composer.runtime.protocol.reports import SystemReport
from composer.runtime.protocol.requests import Instance
from composer.runtime.ros.manager_interface import STATE_QOS
from composer.runtime.supervision.events import Stopping
from tests.ros.support.in_process import Peer, RunningSystem, running, system_of, wait_until

ROBOT = "{system: robot, namespace: fleet, nodes: {planner: {}}}"
STATE = "/fleet/robot/manager/state"


def offer_managers(peer: Peer, *messages: str) -> list[str]:
    """Offer the services of other manager nodes; return the list of those that are asked."""
    requests: list[str] = []

    def offer(name: str, message: str) -> None:
        def respond(_: Any, response: Trigger.Response) -> Trigger.Response:
            requests.append(name)
            response.message = message
            return response

        peer.node.create_service(Trigger, f"/fleet/robot/manager/{name}", respond)

    offer("is_active", messages[0])
    for number, message in enumerate(messages):
        offer(f"_instance_{number:04}", message)
    return requests


def instance(uptime_s: float) -> str:
    return encode(Instance("elsewhere", "4321", uptime_s))


def test_no_message_ends_a_system(tmp_path: Path, peer: Peer) -> None:
    with running(ROBOT, tmp_path) as system:
        received = peer.listen(String, STATE, STATE_QOS)
        wait_until(lambda: received, "a message to replay")
        publisher = peer.publisher(String, STATE, STATE_QOS)
        report = decode(received[0].data, SystemReport)
        replayed = encode(replace(report, host="elsewhere", pid="4321", started_s=1.0))
        forged = itertools.cycle((replayed, replayed.replace("running", "stopped"), ""))

        def flood() -> bool:
            """Publish once more; return whether the manager has published twice meanwhile."""
            publisher.publish(String(data=next(forged)))
            return sum("content" in item.data and "4321" not in item.data for item in received) > 2

        wait_until(flood, "messages of the manager")
        assert not system.reported(Stopping)
        assert "exception" not in system.log_text().lower()
        assert peer.call(Trigger, "/fleet/robot/manager/is_active").success


def test_a_system_is_refused_while_it_starts(tmp_path: Path, peer: Peer) -> None:
    offer_managers(peer, instance(uptime_s=3600.0))
    system = RunningSystem(system_of(ROBOT, tmp_path), HostOptions(), None)
    outcome = system.end()
    assert outcome.exit_code == 1
    assert "system '/fleet/robot' already runs in ROS domain" in outcome.reason
    assert "host elsewhere, process 4321" in outcome.reason


def test_younger_and_unreadable_instances_are_ignored(tmp_path: Path, peer: Peer) -> None:
    odd_host = encode(Instance("a\x1b[2J", "1", 9e9))
    requests = offer_managers(peer, instance(uptime_s=0.0), odd_host, "[" * 100_000)
    with running(ROBOT, tmp_path) as system:
        wait_until(lambda: len(set(requests)) == 3, "requests to the other managers")
        assert peer.call(Trigger, "/fleet/robot/manager/is_active") is not None
        assert not system.reported(Stopping)
        assert "4321" not in system.log_text()


def test_a_system_that_has_started_warns_once(
    tmp_path: Path, peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(other_instances, "START_S", 0.0)
    with running(ROBOT, tmp_path) as system:
        requests = offer_managers(peer, instance(uptime_s=3600.0))
        line = system.wait_for_log("host elsewhere, process 4321")
        assert "stop one of them" in line
        received = peer.listen(String, STATE, STATE_QOS)
        wait_until(lambda: len(received) >= 3, "the next checks, once a second")
        assert system.log().count(line) == 1
        assert requests == ["_instance_0000"]
        assert not system.reported(Stopping)


def test_the_older_instance_is_decided_by_uptime_then_by_name() -> None:
    first, second = Instance("a", "1", 60.0), Instance("a", "2", 30.0)
    assert is_older(first, second)
    assert not is_older(second, first)
    together = Instance("a", "2", 60.05)
    assert is_older(first, together)
    assert not is_older(together, first)
    assert parse_instance(encode(first)) == first
    for text in ("", "[]", encode(Instance("a b", "1", 1.0))):
        assert parse_instance(text) is None
