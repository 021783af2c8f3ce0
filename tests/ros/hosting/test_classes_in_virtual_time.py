"""Unmodified rclpy classes in virtual time: all that they do follows the clock of the run."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from action_msgs.msg import GoalStatus

from composer.runtime.supervision import virtual_time
from composer.testing.failures import TestFailure
from composer.testing.system_test import SystemTest

CLASSES = "tests.ros.support.node_classes"
CALLBACKS = "tests.ros.support.callback_classes"
TIMED = "tests.ros.support.timed_classes"
TIMED_FILE = Path(__file__).parents[1] / "support" / "timed_classes.py"
REFUSED = "tests.ros.support.refused_classes"
#: Timers, a service, coroutines that call it, a lifecycle node, and ports that are declared or not.
FEW = f"""
system: demo
executors: {{pool: {{kind: multi_threaded, threads: 4}}}}
nodes:
  talker:
    class: {CLASSES}:Talker
    executor: pool
    publishers: {{numbers: {{type: std_msgs/msg/Int64}}}}
    parameters: {{period: {{type: double, default: 0.1}}}}
    lifecycle: {{depends_on: [listener]}}
  listener:
    class: {CLASSES}:Listener
    executor: pool
    subscriptions: {{numbers: {{type: std_msgs/msg/Int64}}}}
    services: {{count: {{type: std_srvs/srv/Trigger, always_on: true}}}}
  timers: {{class: "{CALLBACKS}:AsyncTimers"}}
  counter:
    class: {CLASSES}:Counter
    remappings: {{numbers: counted}}
    publishers: {{counted: {{type: std_msgs/msg/Int64}}}}
"""
#: Also callbacks that wait for services, goals and rates, and constructors that wait.
DEMO = f"""{FEW}
  waiter: {{class: "{CALLBACKS}:Waiter", lifecycle: {{depends_on: [talker]}}}}
  caller: {{class: "{CALLBACKS}:BlockingCaller"}}
  busy: {{class: "{CALLBACKS}:Busy", remappings: {{numbers: many}}}}
  sleeper: {{class: "{CALLBACKS}:Sleeper"}}
  navigator: {{class: "{CLASSES}:Navigator"}}
  sender: {{class: "{CLASSES}:Sender"}}
  commander: {{class: "{TIMED}:Commander"}}
"""


def instances(system: SystemTest) -> dict[str, Any]:
    """Return the instances of the classes, by the keys of their nodes."""
    nodes = system._run.host.nodes.items()
    return {name: node.instance for name, node in nodes if hasattr(node, "instance")}


def open_system(folder: Path, text: str, *, real_time: bool = False) -> SystemTest:
    path = folder / "tested.yaml"
    path.write_text(text)
    return SystemTest(path, real_time=real_time)


def test_a_class_of_each_kind(tmp_path: Path) -> None:
    with open_system(tmp_path, DEMO) as system:
        nodes = instances(system)
        system.advance(1.25)
        assert [item.message.data for item in system.messages("/numbers")][:3] == [1, 2, 3]
        assert len(nodes["listener"].numbers) == nodes["talker"].count
        assert system.call("/count").message == str(nodes["talker"].count)
        assert nodes["waiter"].response.success
        assert len(nodes["caller"].responses) > 180
        assert all(response.success for response in nodes["caller"].responses)
        assert nodes["timers"].rounds > 360
        assert nodes["caller"].overlaps == nodes["timers"].overlaps == nodes["busy"].overlaps == 0
        assert nodes["busy"].calls > 30
        assert nodes["sleeper"].rounds > 12
        assert nodes["sender"].statuses == [GoalStatus.STATUS_SUCCEEDED]
        assert nodes["sender"].feedback == 3
        assert nodes["commander"].ends[:2] == [
            (GoalStatus.STATUS_SUCCEEDED, pytest.approx(0.1, abs=0.05)),
            (GoalStatus.STATUS_CANCELED, 0.0),
        ]
        system.transition("counter", "deactivate")
        count = nodes["counter"].count
        system.advance(0.25)
        assert nodes["counter"].count == count
        system.transition("counter", "activate")
        system.set_parameter("talker", "word", "changed")
        system.kill("sleeper")
        system.advance(0.255)
        assert nodes["counter"].count == count + 25
        assert system.states["sleeper"] == "unconfigured"
    assert system.outcome is not None
    assert all(node.errors == 0 for node in system.outcome.nodes)
    timers = [item for item in system.outcome.callbacks if item.kind == "timer"]
    assert [item.name for item in timers if item.node == "/sleeper"] == ["on_timer", "rate"]


def test_the_same_run_whatever_the_hash_seed(tmp_path: Path) -> None:
    path = tmp_path / "demo.yaml"
    path.write_text(DEMO)
    command = (sys.executable, "-m", "tests.ros.programs.virtual_run", str(path), "1")
    outputs = {
        subprocess.run(
            command,
            env=os.environ | {"PYTHONHASHSEED": seed},
            capture_output=True,
            timeout=60,
            check=True,
        ).stdout
        for seed in ("1", "2")
    }
    (output,) = outputs
    assert output.count(b"\n/counted") > 100


def test_clocks_sleeps_deadlines_and_serialized_messages(tmp_path: Path) -> None:
    nodes = f'{{reader: {{class: "{TIMED}:ClockReader"}}, overdue: {{class: "{TIMED}:Overdue"}}}}'
    with open_system(tmp_path, f"system: times\nnodes: {nodes}\n") as system:
        system.advance(3.9)
        times = instances(system)["reader"].times
        assert times == [dict.fromkeys(times[0], pytest.approx(0.75))] * 3
        assert [line.time_s for line in system.log] == [1.75, 3.75]
        system.advance(0.6)
        overdue = instances(system)["overdue"]
        assert overdue.missed == {"offered": 3, "requested": 3}
        assert overdue.raw == [3]


OPERATED = f"""
system: operated
nodes:
  operator: {{class: "{TIMED}:Operator", arguments: {{target: TARGET}}}}
  talker: {{class: "{CLASSES}:Talker", introspection: {{logger_services: true}}}}
  ticker:
    parameters: {{period: {{type: double, default: 0.1}}}}
    introspection: {{logger_services: true}}
"""


@pytest.mark.parametrize("real_time", [False, True])
@pytest.mark.parametrize("target", ["/talker", "/ticker"])
def test_services_of_other_nodes(tmp_path: Path, target: str, *, real_time: bool) -> None:
    text = OPERATED.replace("TARGET", target)
    with open_system(tmp_path, text, real_time=real_time) as system:
        operator = instances(system)["operator"]
        system.run_until(lambda: len(operator.seen) == 9, 20.0)
        states = [True, "inactive", True, "active", False, "active"]
        assert operator.seen == [*states, True, 0.5, True]
        assert system.states[target[1:]] == "active"


@pytest.mark.parametrize("real_time", [False, True])
def test_faults_in_classes(tmp_path: Path, *, real_time: bool) -> None:
    with open_system(tmp_path, FEW, real_time=real_time) as system:
        nodes = instances(system)

        def is_logged(text: str) -> bool:
            return any(text in line.text for line in system.log)

        with pytest.raises(TestFailure, match="counter has no handler 'tik'; did you mean 'tick'"):
            system.raise_in("counter", "tik")
        system.raise_in("listener", "on_number", error="no memory")
        system.raise_in("timers", error="no disk")
        system.run_until(lambda: is_logged("no memory") and is_logged("no disk"), 5.0)
        count = nodes["counter"].count
        system.hang("counter", 1.0)
        system.advance(0.9)
        assert nodes["counter"].count <= count + 1
        system.run_until(lambda: nodes["counter"].count > count + 10, 5.0)
        system.raise_in("counter", "on_deactivate", error="no power")
        with pytest.raises(TestFailure, match=r"'deactivate' of counter failed: .*no power"):
            system.transition("counter", "deactivate")


SLOW = [
    (2.5, "on_configure: TransitionTimeout: timed out after 2.5 s"),
    (2.5, "constructor has not returned; it is at "),
]
UNSERVED = [
    (2.0, "found: False at 1000000002000000000"),
    (2.0, "client 'reader/set_parameters' waits without end: in virtual time, no node"),
    (2.0, "subscription on /parameter_events receives nothing in virtual time"),
]
SPINNING = "node_classes.py:129 uses a thread, which virtual time does not control"


@pytest.mark.parametrize(
    ("node", "lines"),
    [
        (f"{TIMED}:Unserved", UNSERVED),
        (f"{TIMED}:WaitsForever", [(1.0, "waiting"), (2.0, "waiting"), *SLOW]),
        (f"{REFUSED}:NeverReturns", SLOW),
        (
            f"{REFUSED}:SpinsInConstructor",
            [(0.0, "on_configure refused the transition: the class")],
        ),
        (f"{CLASSES}:Spinner", [(0.0, SPINNING)]),
    ],
)
def test_what_a_class_cannot_do_is_reported(
    tmp_path: Path, node: str, lines: list[tuple[float, str]]
) -> None:
    limits = "{timeout_ms: 2500, on_failure: ignore}"
    text = f'system: s\nnodes: {{a: {{class: "{node}", lifecycle: {limits}}}}}\n'
    system = open_system(tmp_path, text)
    with suppress(TestFailure), system:  # it may not come up
        system.advance(0.0)
    logged = [(line.time_s, line.text) for line in system.log]
    assert len(logged) == len(lines)
    for (at_s, text), (expected_s, expected) in zip(logged, lines, strict=True):
        assert expected in text
        assert at_s == pytest.approx(expected_s)


BUSY = "a callback goes on without waiting"


@pytest.mark.parametrize(
    ("node", "arguments", "reason"),
    [
        ("WaitsBusily", "is_ros: true", BUSY),
        ("WaitsBusily", "is_ros: false", BUSY),
        ("Locked", "in_callback: true", "lock_again waits"),
        ("Locked", "in_callback: false", "__init__ waits"),
    ],
)
def test_a_class_that_waits_busily_or_for_a_lock_ends_the_run(
    tmp_path: Path, node: str, arguments: str, reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A busy callback is interrupted after two looks, a waiting one ends the run after sixty.
    monkeypatch.setattr(virtual_time, "LOOK_S", 0.1 if reason == BUSY else 0.01)
    entry = f'{{class: "{TIMED}:{node}", arguments: {{{arguments}}}}}'
    system = open_system(tmp_path, f"system: s\nnodes: {{waiting: {entry}}}\n")
    with suppress(TestFailure), system:
        system.advance(10.0)
    assert system.outcome is not None
    assert system.outcome.exit_code == 1
    assert f"the time does not advance, because {reason} at {TIMED_FILE}:" in system.outcome.reason
    if reason != BUSY:
        name = reason.removesuffix(" waits")
        assert any(f"{name} has not returned for" in line.text for line in system.log)
