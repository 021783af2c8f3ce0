"""Latencies of declared chains."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.ros.support.in_process import RunningSystem, running, wait_until

BRAKE = """
system: brake
nodes:
  lidar:
    publishers: {{scan: {{type: std_msgs/msg/Int64, qos: command}}}}
    timers: {{step: {{period_ms: 20, publish: {{scan: {{data: "{{count}}"}}}}}}}}
  detector:
    behavior: detector:Detector
    subscriptions: {{scan: {{type: std_msgs/msg/Int64, qos: command}}}}
    publishers: {{obstacle: {{type: std_msgs/msg/Int64, qos: command}}}}
  motor:
    state: {{distance: 0}}
    subscriptions:
      obstacle: {{type: std_msgs/msg/Int64, qos: command, set: {{distance: "{{message.data}}"}}}}
    publishers: {{force: {{type: std_msgs/msg/Int64, external: true}}}}
    timers: {{step: {{period_ms: 5, publish: {{force: {{data: "{{state.distance}}"}}}}}}}}
connections:
  - {{topic: /scan, from: lidar.scan, to: detector.scan{more}}}
  - {{topic: /obstacle, from: detector.obstacle, to: motor.obstacle{more}}}
chains:
  stop: {{through: [lidar.scan, detector.obstacle, motor.force], latency_ms: 1}}
  see: {{through: [lidar.scan, detector.obstacle], latency_ms: 10000}}
"""
DETECTOR = """
class Detector:
    async def on_scan(self, message):
        await self.clock.sleep(0.003)
        self.publishers.obstacle.publish(message)
"""


def count(system: RunningSystem, name: str) -> int:
    return next(item.count for item in system.chains() if item.chain == name)


@pytest.mark.parametrize("more", ["", ", delivery: dds", ", isolation: copy"])
def test_data_is_followed_from_the_first_publisher_to_the_last(more: str, tmp_path: Path) -> None:
    with running(BRAKE.format(more=more), tmp_path, detector=DETECTOR) as system:
        wait_until(lambda: count(system, "stop") > 10)
        counted = count(system, "stop")  # first: both grow
        # A message without new data does not count.
        assert counted <= system.node("lidar").sent("scan")
    reported = {item.chain: item for item in system.stop().chains}
    stop, see = reported["stop"], reported["see"]
    assert stop.late == stop.count >= counted
    assert see.late == 0
    assert min(stop.mean_ms, see.mean_ms) > 3.0
