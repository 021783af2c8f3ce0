"""Timers and parameters of a running node."""

from __future__ import annotations

from pathlib import Path

from rcl_interfaces.srv import DescribeParameters, GetParameters
from std_msgs.msg import Int64

from composer.runtime.host_options import HostOptions
from composer.runtime.supervision.events import RollingBack
from tests.ros.support.in_process import Peer, RunningSystem, running, system_of, wait_until

TIMED = """
system: timed
nodes:
  timed:
    parameters:
      rate_hz: {type: double, default: 0.02, unit: Hz, description: Calls a second.}
    publishers: {output: {type: std_msgs/msg/Int64, external: true, qos: {depth: 1000}}}
    timers:
      tick: {rate_hz: "{parameters.rate_hz}", publish: {output: {data: "{count}"}}}
"""


def test_a_timer_follows_its_parameter_and_stops_while_the_node_is_not_active(
    tmp_path: Path, peer: Peer
) -> None:
    with running(TIMED, tmp_path) as system:
        for value in (0.0, -1.0, float("inf")):
            reason = peer.set_parameter("/timed", "rate_hz", value)
            assert reason.startswith("timer 'tick': rate_hz ")
        received = peer.listen(Int64, "/output", 1000)
        assert peer.set_parameter("/timed", "rate_hz", 100.0) == ""
        wait_until(lambda: len(received) >= 10)
        assert peer.change("/timed", "deactivate")
        statistics = system.node("timed").statistics
        sent = statistics.sent
        assert peer.set_parameter("/timed", "rate_hz", 500.0) == ""
        assert peer.change("/timed", "activate")
        wait_until(lambda: statistics.sent >= sent + 10)
    assert [message.data for message in received[:10]] == list(
        range(received[0].data, received[0].data + 10)
    )


def test_a_call_that_is_due_while_the_previous_one_awaits_is_skipped(tmp_path: Path) -> None:
    text = """
    system: late
    nodes:
      late: {behavior: late:Late, timers: {tick: {period_ms: 5}}}
    """
    module = """
    from composer.behavior import Behavior

    class Late(Behavior):
        async def on_tick(self):
            self.log.info("begin")
            await self.clock.sleep(60.0)
    """
    with running(text, tmp_path, late=module) as system:
        statistics = system.node("late").statistics
        wait_until(lambda: statistics.skipped > 10)
        assert system.log() == ["begin"]


PARAMETERS = """
system: parameters
nodes:
  tuned:
    behavior: tuned:Tuned
    parameters:
      speed: {type: double, default: 1, unit: m/s, minimum: 0.0, maximum: 5.0, step: 0.5,
              description: Speed limit.}
      retries: {type: integer, default: 3, minimum: 1}
      mode: {type: string, default: slow, choices: [slow, fast]}
      serial: {type: string, default: abc, read_only: true}
      gains: {type: double_array, default: [1, 2.5], maximum: 10.0}
      offsets: {type: double_array, default: [0.0]}
      mask: {type: byte_array, default: [1, 255]}
    subscriptions:
      ask: {type: std_msgs/msg/Int64, external: true, log: "{parameters.speed} {parameters.mode}"}
"""
TUNED = """
from composer.behavior import Behavior

class Tuned(Behavior):
    def on_configure(self):
        self.log.info(f"{self.parameters.speed} {self.parameters.gains} {self.parameters.mask}")

    def on_parameters(self, changes):
        self.log.info(f"{dict(changes)} {self.parameters.speed}")
        if changes.get("speed") == 2.5:
            raise ValueError("not that one")
"""


REFUSED = [
    ("speed", 9.0, "out of range"),
    ("speed", 0.7, "step"),
    ("speed", float("nan"), "out of range"),
    ("speed", "fast", "Wrong parameter type"),
    ("retries", 0, "out of range"),
    ("retries", 1.0, "Wrong parameter type"),
    ("mode", "other", "parameter 'mode' must be one of: slow, fast; not other"),
    ("serial", "xyz", "read-only"),
    ("gains", [1.0, 11.0], "parameter 'gains' must be at most 10.0, not 11.0"),
    ("gains", [float("nan")], "parameter 'gains' has limits and must be a number"),
    ("unknown", 1, "undeclared parameter"),
]


def test_parameters_are_described_refused_and_changed(tmp_path: Path, peer: Peer) -> None:
    with running(PARAMETERS, tmp_path, tuned=TUNED) as system:
        names = ["speed", "retries", "mode", "serial"]
        request = DescribeParameters.Request(names=names)
        described = peer.call(DescribeParameters, "/tuned/describe_parameters", request)
        request = GetParameters.Request(names=names)
        values = peer.call(GetParameters, "/tuned/get_parameters", request).values
        for name, value, reason in REFUSED:
            assert reason in peer.set_parameter("/tuned", name, value)
        assert system.log() == [r"1.0 [1.0, 2.5] b'\x01\xff'"]
        # A change reaches the behavior and the expressions.
        assert "got 'Type.INTEGER'" in peer.set_parameter("/tuned", "speed", 2)  # as in rclpy
        assert peer.set_parameter("/tuned", "speed", 2.0) == ""
        assert peer.set_parameter("/tuned", "mode", "fast") == ""
        assert peer.set_parameter("/tuned", "offsets", [float("nan"), float("inf")]) == ""
        assert peer.set_parameter("/tuned", "speed", 2.5) == ""
        peer.publisher(Int64, "/ask").publish(Int64())
        system.wait_for_log("2.5 fast")
        counted = system.summary("/tuned")
    speed, retries, mode, serial = described.descriptors
    assert speed.description == "Speed limit. [m/s]"
    limits = speed.floating_point_range[0]
    assert (limits.from_value, limits.to_value, limits.step) == (0.0, 5.0, 0.5)
    limits = retries.integer_range[0]
    assert (limits.from_value, limits.to_value) == (1, 2**63 - 1)
    assert mode.additional_constraints == "one of: slow, fast"
    assert serial.read_only
    assert (values[0].double_value, values[1].integer_value) == (1.0, 3)
    assert system.log()[1:3] == ["{'speed': 2.0} 2.0", "{'mode': 'fast'} 2.0"]
    assert counted.errors == 1


def test_a_parameter_without_a_value_keeps_the_system_from_starting(tmp_path: Path) -> None:
    text = """
    system: incomplete
    nodes:
      first: {on_activate: {log: started}}
      second: {parameters: {speed: {type: double}}}
    """
    system = RunningSystem(system_of(text, tmp_path), HostOptions(), None)
    assert system.end().exit_code == 1
    assert system.log() == []
    assert [event.reason for event in system.reported(RollingBack)] == [
        "parameter 'speed' is required and has no value"
    ]
