"""Ports and timers that are always on also work while their node is inactive."""

from __future__ import annotations

from pathlib import Path

import pytest
from action_msgs.msg import GoalStatus
from composer_interfaces.action import Navigate
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from std_msgs.msg import String
from std_srvs.srv import Trigger

from composer.model import PrimaryState
from tests.ros.support.in_process import Peer, finished, running, wait_until

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
