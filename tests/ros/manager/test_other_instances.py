"""Other processes that run the same system: only a live manager node counts, not a message."""

from __future__ import annotations

import itertools
import json
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, KeyValue
from std_srvs.srv import Trigger

from composer.runtime.host_options import HostOptions
from composer.runtime.manager import other_instances
from composer.runtime.manager.other_instances import Instance, parse_instance
from composer.runtime.ros.manager_protocol import STATE_QOS
from composer.runtime.supervision.events import Stopping
from tests.ros.support.in_process import Peer, RunningSystem, running, system_of, wait_until

ROBOT = "{system: robot, namespace: fleet, nodes: {planner: {}}}"
STATE = "/fleet/robot/manager/state"


def offer_manager(peer: Peer, message: str) -> list[Any]:
    """Offer the services of another manager node, and return its list of requests."""
    requests: list[Any] = []

    def respond(request: Any, response: Trigger.Response) -> Trigger.Response:
        requests.append(request)
        response.message = message
        return response

    for name in ("is_active", "_instance_0123"):
        peer.node.create_service(Trigger, f"/fleet/robot/manager/{name}", respond)
    return requests


def instance(uptime_s: float) -> str:
    return json.dumps({"host": "elsewhere", "pid": 4321, "uptime_s": uptime_s})


def changed(message: DiagnosticArray, **values: str) -> DiagnosticArray:
    forged = deepcopy(message)
    kept = [item for item in forged.status[0].values if item.key not in values]
    forged.status[0].values = kept + [KeyValue(key=key, value=values[key]) for key in values]
    return forged


def test_no_message_ends_a_system(tmp_path: Path, peer: Peer) -> None:
    with running(ROBOT, tmp_path) as system:
        received = peer.listen(DiagnosticArray, STATE, STATE_QOS)
        wait_until(lambda: received, "a message to replay")
        publisher = peer.publisher(DiagnosticArray, STATE, STATE_QOS)
        replayed = changed(received[0], host="elsewhere", pid="4321", uptime="1000000.0")

        forged = itertools.cycle((replayed, changed(replayed, uptime="2e6"), DiagnosticArray()))

        def flood() -> bool:
            """Publish once more; return whether the manager has published twice meanwhile."""
            publisher.publish(next(forged))
            own = [item for item in received if item.status and item.header != replayed.header]
            return len(own) > 1

        wait_until(flood, "messages of the manager")
        assert not system.reported(Stopping)
        assert "exception" not in system.log_text().lower()
        assert peer.call(Trigger, "/fleet/robot/manager/is_active").success


def test_a_system_is_refused_while_it_starts(tmp_path: Path, peer: Peer) -> None:
    offer_manager(peer, instance(uptime_s=3600.0))
    system = RunningSystem(system_of(ROBOT, tmp_path), HostOptions(), None)
    outcome = system.end()
    assert outcome.exit_code == 1
    assert "system '/fleet/robot' already runs in ROS domain" in outcome.reason
    assert "host elsewhere, process 4321" in outcome.reason


@pytest.mark.parametrize(
    "response",
    [instance(uptime_s=0.0), '{"host": "a\\u001b[2J", "pid": 1, "uptime_s": 9e9}', "[" * 100_000],
    ids=["younger", "odd host", "deep"],
)
def test_a_younger_or_unreadable_instance_is_ignored(
    tmp_path: Path, peer: Peer, response: str
) -> None:
    requests = offer_manager(peer, response)
    with running(ROBOT, tmp_path) as system:
        wait_until(lambda: requests, "a request to the other manager")
        assert peer.call(Trigger, "/fleet/robot/manager/is_active") is not None
        assert not system.reported(Stopping)
        assert "4321" not in system.log_text()


def test_a_system_that_has_started_warns_once(
    tmp_path: Path, peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(other_instances, "START_S", 0.0)
    with running(ROBOT, tmp_path) as system:
        requests = offer_manager(peer, instance(uptime_s=3600.0))
        line = system.wait_for_log("host elsewhere, process 4321")
        assert "stop one of them" in line
        received = peer.listen(DiagnosticArray, STATE, STATE_QOS)
        wait_until(lambda: len(received) >= 3, "the next checks, once a second")
        assert system.log().count(line) == 1
        assert sum(request is not None for request in requests) == 1
        assert not system.reported(Stopping)


def test_the_older_instance_is_decided_by_uptime_then_by_name() -> None:
    first, second = Instance("a", 1, 60.0), Instance("a", 2, 30.0)
    assert first.is_older_than(second)
    assert not second.is_older_than(first)
    together = Instance("a", 2, 60.05)
    assert first.is_older_than(together)
    assert not together.is_older_than(first)
    assert parse_instance(first.text) == first
    for text in ("", "[]", "{}", '{"host": 1, "pid": 1, "uptime_s": 1}', "null"):
        assert parse_instance(text) is None
    assert parse_instance('{"host": "a", "pid": 1, "uptime_s": NaN}') is None
    assert parse_instance('{"host": "a", "pid": 1e999, "uptime_s": 1}') is None
