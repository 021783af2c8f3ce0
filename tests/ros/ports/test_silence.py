"""Every port is silent unless its node is active, whatever led to the state."""

from __future__ import annotations

import itertools
import time
from pathlib import Path
from typing import Any

from action_msgs.msg import GoalStatus
from composer_interfaces.action import Navigate
from rclpy.action import ActionClient
from std_msgs.msg import Int64, String
from std_srvs.srv import Trigger

from tests.ros.support.in_process import Peer, RunningSystem, finished, running, wait_until

SYSTEM = """
system: silence
nodes:
  subject:
    behavior: subject:Subject
    parameters: {fault: ""}
    publishers: {beat: {type: std_msgs/msg/Int64, external: true}}
    subscriptions: {order: {type: std_msgs/msg/String, external: true, log: "got {message.data}"}}
    services: {ask: {type: std_srvs/srv/Trigger, external: true, respond: {success: true}}}
    clients: {wait: {type: std_srvs/srv/Trigger, timeout_ms: 60000}}
    action_servers: {drive: {type: composer_interfaces/action/Navigate, external: true}}
    timers: {beat: {period_ms: 10, publish: {beat: {data: "{count}"}}}}
  other:
    behavior: subject:Other
    services: {wait: {type: std_srvs/srv/Trigger}}
"""
MODULE = """
from composer.behavior import Behavior, CallCancelled, TransitionFailed

class Subject(Behavior):
    async def on_order(self, message):
        if message.data.startswith("call"):
            try:
                await self.clients.wait.call(self.clients.wait.service_type.Request())
            except CallCancelled as error:
                self.log.info(f"{message.data} ended: {error}")

    async def on_drive(self, goal):
        await self.clock.sleep(60.0)

    def fail(self, transition):
        if self.parameters.fault == f"refuse {transition}":
            raise TransitionFailed("not now")
        if self.parameters.fault == f"break {transition}":
            raise ValueError("broken")

    def on_activate(self): self.fail("activate")
    def on_deactivate(self): self.fail("deactivate")
    def on_shutdown(self): self.fail("shutdown")

class Other(Behavior):
    async def on_wait(self, request, response):
        await self.clock.sleep(60.0)
"""
#: Where it begins, what goes wrong, what is asked for, where it ends.
WAYS = (
    ("active", "", "deactivate", "inactive"),
    ("active", "break deactivate", "deactivate", "unconfigured"),
    ("active", "refuse deactivate", "deactivate", "active"),
    ("active", "", "shutdown", "finalized"),
    ("active", "break shutdown", "shutdown", "unconfigured"),
    ("inactive", "refuse activate", "activate", "inactive"),
    ("inactive", "break activate", "activate", "unconfigured"),
    ("inactive", "", "shutdown", "finalized"),
    ("unconfigured", "", "shutdown", "finalized"),
)


class Outside:
    """What an external node receives and sends."""

    def __init__(self, system: RunningSystem, peer: Peer) -> None:
        self.system, self.peer = system, peer
        self.beats = peer.listen(Int64, "/beat")
        self._orders = peer.node.create_publisher(String, "/order", 10)
        self._ask = peer.node.create_client(Trigger, "/ask")
        self._drive = ActionClient(peer.node, Navigate, "/drive")
        self._greetings = itertools.count()

    def order(self, text: str) -> None:
        self._orders.publish(String(data=text))

    def start_all(self) -> None:
        assert self.peer.set_parameter("/subject", "fault", "") == ""
        is_recreated = self.peer.state("/subject") == "finalized"
        known = self.peer.servers("/subject/get_state")
        assert self.peer.call(Trigger, "/silence/manager/startup").success
        if is_recreated:
            wait_until(lambda: self.peer.servers("/subject/get_state") - known, "the new node")
        assert self.peer.state("/subject") == "active"
        # Of two participants in one process, one may never notice that a subscription is gone, so a
        # match proves nothing: wait for a message.
        greeting = f"greeting {next(self._greetings)}"
        wait_until(lambda: self._is_received(greeting), "a command is received")
        wait_until(self._ask.service_is_ready)
        wait_until(self._drive.server_is_ready)

    def _is_received(self, text: str) -> bool:
        self.order(text)
        return f"got {text}" in self.system.log_text()

    def goal(self) -> Any:
        return finished(self.peer.run(lambda: self._drive.send_goal_async(Navigate.Goal())))

    def begin_work(self, name: str) -> Any:
        """Start a call and a goal that take a minute; return the future of the goal."""
        self.order(name)
        self.system.wait_for_log(f"got {name}")
        goal = self.goal()
        assert goal.accepted
        return self.peer.run(goal.get_result_async)

    def check_that_it_works(self, name: str) -> None:
        seen = len(self.beats)
        wait_until(lambda: len(self.beats) > seen + 3, "it publishes")
        self.order(f"order {name}")
        self.system.wait_for_log(f"got order {name}")
        assert finished(self._ask.call_async(Trigger.Request())).success
        assert self.goal().accepted

    def nothing_comes(self) -> bool:
        """Return whether no message arrives in a time that is long for a period of 10 ms."""
        seen = len(self.beats)
        time.sleep(0.15)
        return len(self.beats) == seen

    def check_silence(self, name: str, state: str) -> None:
        self.order(f"order {name}")
        wait_until(self.nothing_comes, "the messages in transit arrive")
        assert f"got order {name}" not in self.system.log_text()
        if state == "inactive":
            refusal = finished(self._ask.call_async(Trigger.Request()))
            assert (refusal.success, refusal.message) == (False, "/subject is inactive, not active")
            assert not self.goal().accepted
        else:
            wait_until(lambda: not self._ask.service_is_ready(), "no service")
            wait_until(lambda: not self._drive.server_is_ready(), "no action")
            wait_until(lambda: self.peer.node.count_publishers("/beat") == 0, "no publisher")


def test_nothing_passes_unless_active(tmp_path: Path, peer: Peer) -> None:
    with running(SYSTEM, tmp_path, subject=MODULE) as system:
        outside = Outside(system, peer)
        for number, (start, fault, transition, end) in zip(itertools.count(), WAYS, strict=False):
            name = f"call {number}"
            outside.start_all()
            work = outside.begin_work(name) if start == "active" else None
            if start != "active":
                assert peer.change("/subject", "deactivate")
            if start == "unconfigured":
                assert peer.change("/subject", "cleanup")
            assert peer.set_parameter("/subject", "fault", fault) == ""
            assert peer.change("/subject", transition) is (fault == ""), WAYS[number]
            assert peer.state("/subject") == end, WAYS[number]
            if work is not None:
                system.wait_for_log(f"{name} ended: /subject is ")
                assert finished(work).status == GoalStatus.STATUS_CANCELED
            if end == "active":
                outside.check_that_it_works(name)
            else:
                outside.check_silence(name, end)
        outside.start_all()
        assert system.stop().exit_code == 0
