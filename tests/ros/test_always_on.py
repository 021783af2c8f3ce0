"""Ports and timers that are always on live while their node is inactive, too; others do not."""

from __future__ import annotations

from pathlib import Path

import pytest
from std_msgs.msg import String
from std_srvs.srv import Trigger

from composer.model import PrimaryState
from tests.ros.system_bench import Peer, finished, running, wait_until

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
    async def on_ask(self, request, response):
        self.log.info("asked")
        await self.clock.sleep(self.parameters.pause_s)
        response.success = True
        return response

    def on_cut(self, request, response):
        response.success = True
        return response

    def on_cleanup(self):
        self.publishers.voltage.publish(self.publishers.voltage.message_type(data="last"))
"""


@pytest.mark.parametrize("kind", ["events", "multi_threaded"])
def test_what_is_always_on_lives_while_its_node_is_inactive(
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
        beats = len(voltage)
        assert peer.change("/power", "deactivate")
        seen = len(current)
        wait_until(lambda: len(voltage) > beats + 3, "the timer goes on")
        assert len(current) <= seen + 1
        assert peer.call(Trigger, "/ask").success

        assert peer.change("/power", "cleanup")
        wait_until(lambda: voltage[-1].data == "last", "a last word")


def test_what_waits_in_a_port_that_is_always_on_ends_with_the_cleanup(
    tmp_path: Path, peer: Peer
) -> None:
    text = POWER.replace("KIND", "events").replace("pause_s: 0.01", "pause_s: 60.0")
    with running(text, tmp_path, autostart=PrimaryState.INACTIVE, power=MODULE) as system:
        answer = peer.client(Trigger, "/ask").call_async(Trigger.Request())
        system.wait_for_log("asked")  # what begins while the node is active ends with that
        assert peer.change("/power", "activate")
        assert peer.change("/power", "deactivate")
        assert not answer.done()
        assert peer.change("/power", "cleanup")
        refusal = finished(answer)
        assert not refusal.success
        assert "CallCancelled" in refusal.message
