"""Ports of inactive nodes: silent, whatever led to the state, unless they are always on."""

from __future__ import annotations

import itertools
import time
from pathlib import Path
from typing import Any

import pytest
from action_msgs.msg import GoalStatus
from composer_interfaces.action import Navigate
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.action import ActionClient
from std_msgs.msg import Int64, String
from std_srvs.srv import Trigger

from composer.model import PrimaryState
from tests.ros.support.in_process import Peer, RunningSystem, finished, running, wait_until

POWER = """
system: power
executors: {default: {kind: KIND}}
nodes:
  power:
    behavior: power:Power
    parameters: {pause_s: 0.01}
    publishers:
      voltage: {type: std_msgs/msg/String, always_on: true, external: true}
      current: {type: std_msgs/msg/String, external: true}
    subscriptions:
      switch:
        {type: std_msgs/msg/String, always_on: true, external: true, log: "switch {message.data}"}
      load: {type: std_msgs/msg/String, external: true, log: "load {message.data}"}
    services:
      ask: {type: std_srvs/srv/Trigger, always_on: true, external: true}
      cut: {type: std_srvs/srv/Trigger, external: true}
    timers:
      beat:
        period_ms: 10
        always_on: true
        publish: {voltage: {data: "beat {count}"}, current: {data: beat}}
"""
MODULE = """
from composer.behavior import Behavior

class Power(Behavior):
    is_last_received = False

    async def on_ask(self, request, response):
        self.log.info("asked")
        await self.clock.sleep(self.parameters.pause_s)
        response.success = True
        return response

    def on_cut(self, request, response):
        response.success = True
        return response

    async def on_cleanup(self):
        self.publishers.voltage.publish(self.publishers.voltage.message_type(data="last"))
        while not self.is_last_received:  # its publisher is destroyed afterwards
            await self.clock.sleep(0.01)
"""


@pytest.mark.parametrize("kind", ["events", "multi_threaded"])
def test_always_on_ports_work_while_their_node_is_inactive(
    tmp_path: Path, peer: Peer, kind: str
) -> None:
    text = POWER.replace("KIND", kind)
    with running(text, tmp_path, autostart=PrimaryState.INACTIVE, power=MODULE) as system:
        voltage = peer.listen(String, "/voltage")
        current = peer.listen(String, "/current")
        wait_until(lambda: len(voltage) >= 3, "messages of the publisher that is always on")
        assert peer.call(Trigger, "/ask").success
        refusal = peer.call(Trigger, "/cut")
        assert (refusal.success, refusal.message) == (False, "/power is inactive, not active")
        peer.publisher(String, "/load").publish(String(data="lost"))
        peer.publisher(String, "/switch").publish(String(data="kept"))
        system.wait_for_log("switch kept")
        assert not current
        assert "load lost" not in system.log_text()

        assert peer.change("/power", "activate")
        wait_until(lambda: current, "messages of the other publisher")
        assert peer.change("/power", "deactivate")

        def is_the_only_one() -> bool:
            beats, seen = len(voltage), len(current)
            wait_until(lambda: len(voltage) > beats + 3, "the timer continues")
            return len(current) == seen

        wait_until(is_the_only_one, "the messages in transit arrive, and then no more")
        assert peer.call(Trigger, "/ask").success

        request = ChangeState.Request(transition=Transition(label="cleanup"))
        cleanup = peer.client(ChangeState, "/power/change_state").call_async(request)
        wait_until(lambda: "last" in [message.data for message in voltage], "a last message")
        system.behavior("power").is_last_received = True
        assert finished(cleanup).success


def test_calls_of_always_on_ports_end_with_the_cleanup(tmp_path: Path, peer: Peer) -> None:
    text = POWER.replace("KIND", "events").replace("pause_s: 0.01", "pause_s: 60.0")
    with running(text, tmp_path, autostart=PrimaryState.INACTIVE, power=MODULE) as system:
        answer = peer.client(Trigger, "/ask").call_async(Trigger.Request())
        system.wait_for_log("asked")  # a call from the active state ends with that state
        assert peer.change("/power", "activate")
        assert peer.change("/power", "deactivate")
        assert not answer.done()
        system.behavior("power").is_last_received = True
        assert peer.change("/power", "cleanup")
        refusal = finished(answer)
        assert not refusal.success
        assert "CallCancelled" in refusal.message


CALLING = """
system: calling
nodes:
  power:
    lifecycle: {autostart: inactive, depends_on: [other]}
    behavior: power:Power
    services: {probe: {type: std_srvs/srv/Trigger, always_on: true, external: true}}
    clients:
      ping: {type: std_srvs/srv/Trigger, service: pong, always_on: true}
      gated: {type: std_srvs/srv/Trigger, service: pong}
    action_clients:
      send: {type: composer_interfaces/action/Navigate, action: drive, always_on: true}
      gated: {type: composer_interfaces/action/Navigate, action: drive}
    action_servers:
      charge:
        type: composer_interfaces/action/Navigate
        always_on: true
        external: true
        result: {success: true}
      move: {type: composer_interfaces/action/Navigate, external: true, result: {success: true}}
  other:
    services: {pong: {type: std_srvs/srv/Trigger, respond: {success: true}}}
    action_servers: {drive: {type: composer_interfaces/action/Navigate, result: {success: true}}}
"""
CALLING_MODULE = """
from composer.behavior import Behavior, CallCancelled

class Power(Behavior):
    async def on_probe(self, request, response):
        found = []
        for name in ("ping", "gated"):
            client = self.clients[name]
            try:
                await client.call(client.service_type.Request())
                found.append(f"{name} answered")
            except CallCancelled:
                found.append(f"{name} refused")
        for name in ("send", "gated"):
            client = self.action_clients[name]
            try:
                sent = await client.send_goal(client.action_type.Goal())
                found.append(f"{name} {(await sent.result()).status}")
            except CallCancelled:
                found.append(f"{name} refused")
        response.message = ", ".join(found)
        return response
"""


def test_clients_and_actions_that_are_always_on(tmp_path: Path, peer: Peer) -> None:
    def goal_is_taken(name: str) -> bool:
        client = peer.action_client(Navigate, name)
        goal = finished(peer.run(lambda: client.send_goal_async(Navigate.Goal())))
        if goal.accepted:
            status = finished(peer.run(goal.get_result_async)).status
            assert status == GoalStatus.STATUS_SUCCEEDED
        return bool(goal.accepted)

    with running(CALLING, tmp_path, power=CALLING_MODULE):
        inactive = "ping answered, gated refused, send succeeded, gated refused"
        assert peer.call(Trigger, "/probe").message == inactive
        assert goal_is_taken("/charge")
        assert not goal_is_taken("/move")
        assert peer.change("/power", "activate")
        assert peer.call(Trigger, "/probe").message == inactive.replace(
            "gated refused, send", "gated answered, send"
        ).replace("gated refused", "gated succeeded")
        assert goal_is_taken("/move")
        assert peer.change("/power", "deactivate")
        assert peer.call(Trigger, "/probe").message == inactive
        assert goal_is_taken("/charge")
        assert not goal_is_taken("/move")


GATED = """
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
  other: {behavior: subject:Other, services: {wait: {type: std_srvs/srv/Trigger}}}
"""
GATED_MODULE = """
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
    with running(GATED, tmp_path, subject=GATED_MODULE) as system:
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
