"""External lifecycle managers move nodes without pauses, and the supervisor undoes nothing."""

from __future__ import annotations

import itertools
import subprocess
import sys
import threading
from collections.abc import Coroutine, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.qos import QoSProfile

from composer.model import PrimaryState
from composer.runtime.supervision.events import NodeTransitionFailed
from tests.ros.support.in_process import Peer, running, wait_until
from tests.ros.support.system_process import RunningSystem

SYSTEM = "systems/pipeline.yaml"
SENSOR = "/perception/sensor_simulator"
PLANNER = "/planning/planner"
MOTOR = "/control/motor_controller"
TRANSITIONS = 20_000
NUMBERS = itertools.count()
UP, DOWN = ("configure", "activate"), ("deactivate", "cleanup")


class LifecycleManager:
    """A client that moves some nodes, each request right after the response to the last one."""

    def __init__(
        self, peer: Peer, nodes: Sequence[str], requests: Iterable[tuple[str, str | int]]
    ) -> None:
        self.answers: list[bool] = []
        self.failed: list[str] = []
        self._requests = iter(requests)
        ros_node = peer.join(f"manager_{next(NUMBERS)}")
        # With Fast DDS, each client receives all responses, and keeps ten by default.
        self._clients = {
            node: ros_node.create_client(
                ChangeState, f"{node}/change_state", qos_profile=QoSProfile(depth=1000)
            )
            for node in nodes
        }
        for client in self._clients.values():
            wait_until(client.service_is_ready)
        peer.wait_until_known(nodes[0])

    def send(self) -> None:
        for node, wanted in self._requests:
            key = "label" if isinstance(wanted, str) else "id"
            request = ChangeState.Request(transition=Transition(**{key: wanted}))
            future = self._clients[node].call_async(request)
            future.add_done_callback(partial(self._on_response, f"{node} {wanted}"))
            return

    def _on_response(self, requested: str, future: Any) -> None:
        self.answers.append(bool(future.result().success))
        if not self.answers[-1]:
            self.failed.append(f"{requested}, request {len(self.answers)}")
        self.send()


def count_answers(managers: Sequence[LifecycleManager]) -> int:
    return sum(len(manager.answers) for manager in managers)


def down_and_up(nodes: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    down = [(node, transition) for transition in DOWN for node in reversed(nodes)]
    up = [(node, transition) for transition in UP for node in nodes]
    return itertools.cycle([*down, *up])


@contextmanager
def busy_processors(count: int) -> Iterator[None]:
    """Keep processors busy with other processes."""
    program = [sys.executable, "-c", "while True: pass"]
    processes = [subprocess.Popen(program) for _ in range(count)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.wait()


@pytest.mark.parametrize(
    "managed",
    [
        pytest.param([(SENSOR, PLANNER, MOTOR)], id="one manager"),
        pytest.param([(SENSOR, PLANNER), (MOTOR,)], id="two managers"),
    ],
)
@pytest.mark.soak
@pytest.mark.timeout(1800)
def test_no_external_transition_is_undone(peer: Peer, managed: list[tuple[str, ...]]) -> None:
    with RunningSystem(SYSTEM) as system, busy_processors(2):
        system.wait_for("3 of 3 nodes active")
        each = TRANSITIONS // len(managed)
        managers = [
            LifecycleManager(peer, nodes, itertools.islice(down_and_up(nodes), each))
            for nodes in managed
        ]
        started = len(system.lines)
        for manager in managers:
            manager.send()
        while (seen := count_answers(managers)) < each * len(managers):
            wait_until(lambda seen=seen: count_answers(managers) > seen, "a response")
        assert system.stop()[0] == 0
    failed = [text for manager in managers for text in manager.failed]
    lines = system.lines[started:]
    stopping = next(place for place, line in enumerate(lines) if "shutting down:" in line)
    moved = [line for line in lines[:stopping] if "[compose] /" in line]
    print(f"{TRANSITIONS} transitions, {len(failed)} failed, {len(moved)} changes of state")
    assert not failed
    assert len(moved) == TRANSITIONS, "the supervisor has moved a node"


def test_a_node_that_was_shut_down_meanwhile_does_not_fail(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As by the coordinating process of the system, when it also ends this one."""
    text = "{system: robot, nodes: {arm: {}}}"
    with running(text, tmp_path, autostart=PrimaryState.UNCONFIGURED) as system:
        node, is_free, is_requested = system.node("arm"), threading.Event(), threading.Event()
        run_task = node.loop.run_task

        def noted(work: Coroutine[Any, Any, Any]) -> Any:
            is_requested.set()
            return run_task(work)

        node.loop.call_soon(is_free.wait)
        change = node.loop.run_task(node.lifecycle.change("shutdown"))
        monkeypatch.setattr(node.loop, "run_task", noted)
        system.host.stop("the test is over")
        wait_until(is_requested.is_set, "the step of the tear-down")
        is_free.set()
        assert system.end().exit_code == 0
        assert change.result().success
        assert not system.reported(NodeTransitionFailed)
        assert "refused" not in system.log_text()
