"""A test drives a system in virtual time: what it does, what it sees, and what it reports."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import pytest

from composer.runtime.process import StartRefused
from composer.runtime.ros.messages import MessageError
from composer.testing.failures import TestFailure
from composer.testing.system_test import SystemTest

SYSTEMS = Path(__file__).parents[3] / "systems"

COUNTING = """\
system: counting
nodes:
  counter:
    namespace: /lab
    parameters:
      step: {type: double, default: 1.0, minimum: 0.0}
    subscriptions:
      numbers:
        type: std_msgs/msg/Int32
        topic: /numbers
        publish: {sums: {data: "{message.data}"}}
    publishers:
      sums: {type: std_msgs/msg/Int32, topic: /sums, qos: {depth: 100}}
    services:
      trigger:
        type: std_srvs/srv/Trigger
        service: /trigger
        respond: {success: true, message: done}
    on_activate: {log: counting}
"""


def test_a_minute_of_a_system() -> None:
    with SystemTest(SYSTEMS / "pipeline.yaml") as system:
        assert set(system.states.values()) == {"active"}
        system.advance(60.0)
        assert system.now_s == pytest.approx(60.0)
        assert len(system.messages("/sensor_data")) == pytest.approx(1800, abs=2)
        time.sleep(0)  # a test may use the time of the computer
        system.transition("planner", "deactivate")
        assert system.states["planner"] == "inactive"
    assert system.outcome is not None
    assert system.outcome.exit_code == 0


@pytest.fixture
def counting(tmp_path: Path) -> Path:
    """A declarative node that passes numbers on."""
    path = tmp_path / "counting.yaml"
    path.write_text(COUNTING, encoding="utf-8")
    return path


@pytest.mark.parametrize("real_time", [False, True])
def test_verbs(counting: Path, *, real_time: bool) -> None:
    with SystemTest(counting, real_time=real_time) as system:
        system.publish("/numbers", {"data": 7})
        system.run_until(lambda: system.messages("/sums"), 5.0)
        assert [item.message.data for item in system.messages("/sums")] == [7]
        assert system.call("/trigger").message == "done"
        system.set_parameter("counter", "step", 2)
        with pytest.raises(TestFailure, match="refused step = -1"):
            system.set_parameter("counter", "step", -1)
        assert ("/lab/counter", "counting") in [(line.node, line.text) for line in system.log]
        with pytest.raises(TestFailure, match="'activate' of /lab/counter failed: refused"):
            system.transition("/lab/counter", "activate")
    assert "test: called /trigger with {}" in "\n".join(system.timeline())


MISTAKES: list[tuple[Callable[[SystemTest], object], str]] = [
    (lambda system: system.messages("/sum"), "publisher on '/sum'; did you mean '/sums'"),
    (lambda system: system.publish("/number", {}), "did you mean '/numbers'"),
    (lambda system: system.call("/triger"), "service '/triger'; did you mean '/trigger'"),
    (lambda system: system.transition("conter", "activate"), "did you mean 'counter'"),
    (lambda system: system.raise_in("counter"), "counter has no behavior"),
    (lambda system: system.run_until(lambda: False, 2.0), "not true within 2 s"),
]


def test_mistakes_of_a_test_are_named(counting: Path) -> None:
    with SystemTest(counting) as system:
        for act, text in MISTAKES:
            with pytest.raises(TestFailure, match=text):
                act(system)
        with pytest.raises(MessageError, match="data"):
            system.publish("/numbers", {"data": "seven"})
        with pytest.raises(ZeroDivisionError):
            system.run_until(lambda: 1 / 0, 1.0)


def _passed_on(system: SystemTest) -> list[int]:
    """Return what arrives of four numbers."""
    before = len(system.messages("/sums"))
    for number in range(4):
        system.publish("/numbers", {"data": number})
        system.advance(1.0)
    system.advance(10.0)
    return [item.message.data for item in system.messages("/sums")[before:]]


FAULTS: list[tuple[Callable[[SystemTest], object], list[int]]] = [
    (lambda system: system.drop("/numbers", count=2), [2, 3]),
    (lambda system: system.drop("/numbers", for_s=1.5), [2, 3]),
    (lambda system: system.drop("/numbers", count=2, skip=1), [0, 3]),
    (lambda system: system.duplicate("/numbers", count=1), [0, 0, 1, 2, 3]),
    (lambda system: system.reorder("/numbers"), [1, 0, 3, 2]),
    (lambda system: system.delay("/numbers", 2.5, count=1), [1, 2, 0, 3]),
    (lambda system: system.corrupt("/numbers", lambda m: setattr(m, "data", 9)), [9] * 4),
]


def test_faults_of_topics(counting: Path) -> None:
    with SystemTest(counting) as system:
        for disturb, expected in FAULTS:
            disturb(system)
            assert _passed_on(system) == expected
            system.end_faults("/numbers")
            assert _passed_on(system) == [0, 1, 2, 3]


def test_faults_of_nodes() -> None:
    with SystemTest(SYSTEMS / "pipeline.yaml") as system:
        system.raise_in("planner", error="no memory")
        system.advance(2.0)
        assert any("no memory" in line.text for line in system.log)
        before_s = system.now_s
        system.hang("motor_controller", 3.0)
        system.advance(5.0)
        assert system.now_s == before_s + 5.0
        system.kill("planner")
        system.run_until(lambda: system.states["planner"] != "active", 1.0)
        assert any("killed by the test" in str(event) for event in system.events)


def test_goals() -> None:
    with SystemTest(SYSTEMS / "navigation.yaml") as system:
        goal = system.send_goal("/navigate", {"target": {"x": 1.0}, "max_velocity": 1.0})
        assert goal.result().status == "succeeded"
        assert goal.feedback
        other = system.send_goal("/navigate", {"target": {"x": 9.0}, "max_velocity": 1.0})
        system.advance(0.5)
        assert other.cancel()
        assert other.result().status == "canceled"


def test_systems_that_cannot_be_tested_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "s.yaml"
    path.write_text("system: s\nnodes: {camera: {external: true}}\n", encoding="utf-8")
    with pytest.raises(StartRefused, match="camera is an external node"), SystemTest(path):
        pass
    path.write_text("system: s\nnodez: {}\n", encoding="utf-8")
    with pytest.raises(TestFailure, match="did you mean 'nodes'"):
        SystemTest(path)


TIMED = """\
system: timed
nodes:
  source:
    publishers: {scan: {type: std_msgs/msg/String, topic: /scan, qos: {deadline_ms: 200}}}
    timers: {tick: {period_ms: 100, publish: {scan: {data: x}}}}
  sink:
    subscriptions: {scan: {type: std_msgs/msg/String, topic: /scan, qos: {deadline_ms: 200}}}
"""


def test_lost_messages_miss_the_deadline_of_the_subscription_only(tmp_path: Path) -> None:
    path = tmp_path / "timed.yaml"
    path.write_text(TIMED, encoding="utf-8")
    with SystemTest(path) as system:
        system.advance(1.05)
        assert not system.log
        system.drop("/scan")
        system.advance(0.2)
        [line] = system.log
        assert (line.node, round(line.time_s, 3)) == ("/sink", 1.2)
        assert "nothing was received within its deadline of 200 ms" in line.text
