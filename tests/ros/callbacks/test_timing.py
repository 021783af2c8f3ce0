"""Timing of callbacks of all kinds and of chains, in a running system and in every view."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from composer.runtime.host_options import HostOptions
from composer.runtime.metrics.statistics import CallbackStatistics
from tests.ros.support.commands import output_of
from tests.ros.support.in_process import Peer, RunningSystem, running, wait_until
from tests.ros.support.system_process import RunningSystem as CommandProcess
from tests.ros.support.system_process import write_system

EVERY_KIND = """
system: traced
nodes:
  server:
    behavior: traced:Server
    subscriptions: {number: {type: std_msgs/msg/Int64, budget_ms: 1}}
    services: {ask: {type: std_srvs/srv/Trigger, budget_ms: 1}}
    action_servers: {go: {type: composer_interfaces/action/Navigate, budget_ms: 1}}
  client:
    publishers: {number: {type: std_msgs/msg/Int64}}
    clients: {ask: {type: std_srvs/srv/Trigger, budget_ms: 0.000001, on_response: {log: asked}}}
    action_clients:
      go:
        type: composer_interfaces/action/Navigate
        budget_ms: 0.000001
        on_feedback: {log: going}
        on_result: {log: gone}
    timers:
      tick:
        period_ms: 50
        budget_ms: 0.000001
        publish: {number: {data: "{count}"}}
        call: {ask: {}, go: {}}
"""
SERVER = """
import time
from composer_interfaces.action import Navigate

def work():
    until_s = time.monotonic() + 0.002
    while time.monotonic() < until_s:
        pass

class Server:
    async def on_number(self, message):
        work()
        await self.clock.sleep(0.4)
        work()

    def on_ask(self, request, response):
        work()
        return response

    async def on_go(self, goal):
        work()
        await self.clock.sleep(0.02)
        goal.publish_feedback(Navigate.Feedback())
"""


def counted(system: RunningSystem, node: str) -> dict[str, CallbackStatistics]:
    callbacks = system.node(node).statistics.callbacks
    return {kind: callback for (kind, _), callback in callbacks.items()}


def test_every_kind_of_callback_is_timed_and_checked_against_its_budget(tmp_path: Path) -> None:
    with running(EVERY_KIND, tmp_path, traced=SERVER) as system:
        server, client = counted(system, "server"), counted(system, "client")
        every = [*server.values(), *client.values()]
        wait_until(lambda: all(callback.overruns > 2 for callback in every), "calls of all kinds")
        text = system.log_text()
    assert {*server, *client} == {
        "subscription",
        "service",
        "action server",
        "client",
        "action client",
        "timer",
    }
    for callback in every:
        assert callback.overruns <= callback.times.count
        assert f"{callback} took " in text
    # The time that an async callback awaits does not count; its work after that does.
    times = server["subscription"].times
    assert times.longest_s >= 0.004
    assert times.percentile_s(0.5) < 0.36  # right within a tenth; the machine may stall once
    assert client["timer"].lateness.count == client["timer"].times.count
    outcome = system.stop()
    reported = {(item.node, item.kind): item for item in outcome.callbacks}
    assert reported["/server", "service"].count == server["service"].times.count


def test_without_tracing_only_callbacks_with_a_budget_are_timed(tmp_path: Path) -> None:
    text = """
    system: untraced
    nodes:
      quick: {timers: {tick: {period_ms: 5, set: {}}, tock: {period_ms: 5, budget_ms: 50, set: {}}}}
    """
    with running(text, tmp_path, options=HostOptions(tracing=False)) as system:
        callbacks = system.node("quick").statistics.callbacks
        wait_until(lambda: callbacks["timer", "tock"].times.count > 20, "calls")
    assert callbacks["timer", "tick"].times.count == 0
    assert callbacks["timer", "tick"].lateness.count == 0


FLOOD = """
system: flood
nodes:
  source:
    behavior: flood:Source
    publishers: {number: {type: std_msgs/msg/Int64, qos: {depth: 5000}}}
    timers: {tick: {period_ms: 10}}
  sink:
    behavior: flood:Sink
    subscriptions: {number: {type: std_msgs/msg/Int64, qos: {depth: 5000}}}
"""
SOURCE_AND_SINK = """
from std_msgs.msg import Int64

class Source:
    has_sent = False

    def on_tick(self):
        if not self.has_sent:
            self.has_sent = True
            for number in range(4100):
                self.publishers.number.publish(Int64(data=number))

class Sink:
    def on_number(self, message):
        return None if message.data < 4000 else self.later()

    async def later(self):
        pass
"""


def test_of_frequent_callbacks_each_call_counts_once_even_if_it_awaits(tmp_path: Path) -> None:
    """If frequent, one of sixteen calls is timed with their weight, unless one awaits."""
    with running(FLOOD, tmp_path, flood=SOURCE_AND_SINK) as system:
        node = system.node("sink")
        wait_until(lambda: node.statistics.received == 4100, "all are there")
        times = node.statistics.callbacks["subscription", "number"].times
        wait_until(lambda: abs(times.count - 4100) < 32, f"{times.count} counted")


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


def count_of(system: RunningSystem, name: str) -> int:
    return next(item.count for item in system.chains() if item.chain == name)


@pytest.mark.parametrize("more", ["", ", delivery: dds", ", isolation: copy"])
def test_data_is_followed_from_the_first_publisher_to_the_last(more: str, tmp_path: Path) -> None:
    with running(BRAKE.format(more=more), tmp_path, detector=DETECTOR) as system:
        wait_until(lambda: count_of(system, "stop") > 10)
        counted = count_of(system, "stop")  # first: both grow
        # A message without new data does not count.
        assert counted <= system.node("lidar").sent("scan")
    reported = {item.chain: item for item in system.stop().chains}
    stop, see = reported["stop"], reported["see"]
    assert stop.late == stop.count >= counted
    assert see.late == 0
    assert min(stop.mean_ms, see.mean_ms) > 3.0


SYSTEM = """
system: timed
nodes:
  worker: {behavior: timed:Worker, timers: {work: {period_ms: 100, budget_ms: 20}}}
  victim: {timers: {tick: {period_ms: 10, set: {}}}}
  source:
    behavior: timed:Source
    publishers: {burst: {type: std_msgs/msg/Int64, qos: {depth: 100}}}
    timers: {send: {period_ms: 100}}
  sink:
    subscriptions: {burst: {type: std_msgs/msg/Int64, qos: {depth: 2}, publish: {last: {}}}}
    publishers: {last: {type: std_msgs/msg/Int64, external: true}}
connections:
  - {topic: /burst, from: source.burst, to: sink.burst}
chains:
  through: {through: [source.burst, sink.last], latency_ms: 10000}
"""
BEHAVIORS = """
import time
from composer.behavior import Behavior
from std_msgs.msg import Int64

class Worker(Behavior):
    '''Takes 5 ms, and each tenth time 40 ms.'''

    def on_configure(self):
        self.calls = 0

    def on_work(self):
        self.calls += 1
        # The duration of the callback is what is measured.
        time.sleep(0.005 if self.calls % 10 else 0.04)

class Source(Behavior):
    def on_send(self):
        for _ in range(5):
            self.publishers.burst.publish(Int64())
"""
#: So many calls of the worker that the long ones are among them.
ENOUGH = 25


def compose(*arguments: str) -> dict[str, Any]:
    """Return the last line that a command prints, which is JSON."""
    found: dict[str, Any] = json.loads(output_of(*arguments, "--timeout", "20"))
    return found


@pytest.fixture(scope="module")
def system(
    tmp_path_factory: pytest.TempPathFactory, shared_domain_id: int
) -> Iterator[CommandProcess]:
    path = write_system(tmp_path_factory.mktemp("timed"), SYSTEM, timed=BEHAVIORS)
    with CommandProcess(str(path)) as running:
        running.wait_for("4 of 4 nodes active")
        yield running


def verify(callbacks: list[dict[str, Any]]) -> bool:
    """Compare figures with what the nodes do; return whether there are enough yet."""
    found = {(item["node"], item["name"]): item for item in callbacks}
    work, tick = found["/worker", "work"], found["/victim", "tick"]
    if int(work["count"]) < ENOUGH:
        return False
    mean_ms, p99_ms, longest_ms = (float(work[f"{key}_ms"]) for key in ("mean", "p99", "longest"))
    assert 5.0 <= mean_ms < p99_ms * 1.1
    assert 36.0 <= p99_ms <= longest_ms * 1.1  # a percentile is right within a tenth
    assert longest_ms >= 40.0
    assert 2 <= int(work["overruns"]) <= int(work["count"])
    # It waits for the worker, and during its long calls it misses some.
    assert float(tick["late_longest_ms"]) > 20.0
    assert float(tick["late_p99_ms"]) <= float(tick["late_longest_ms"]) * 1.1
    burst = found["/sink", "burst"]
    assert int(burst["dropped"]) > 0
    assert (
        int(burst["dropped"]) >= int(burst["count"]) * 1.4
    )  # three of five are dropped, two received
    return True


def test_compose_top_and_compose_ps(system: CommandProcess) -> None:
    wait_until(lambda: verify(compose("top", "--once", "--json")["callbacks"]), "calls")
    (status,) = compose("ps", "--json")["systems"]
    assert verify(
        [item | {"node": node["node"]} for node in status["nodes"] for item in node["callbacks"]]
    )
    (chain,) = status["chains"]
    assert (chain["chain"], chain["late"]) == ("through", 0)
    assert 0.0 < chain["mean_ms"] <= chain["longest_ms"] < 10_000.0


def test_diagnostics(system: CommandProcess, peer: Peer) -> None:
    received = peer.listen(DiagnosticArray, "/diagnostics")

    def statuses() -> dict[str, DiagnosticStatus]:
        return {status.name: status for status in received[-1].status} if received else {}

    def values(name: str) -> dict[str, str]:
        return {item.key: item.value for item in statuses()[name].values}

    def callbacks() -> list[dict[str, str]]:
        return [values(name) for name in statuses() if "'" in name]

    wait_until(lambda: callbacks() and verify(callbacks()), "calls")
    work = statuses()["timed: /worker timer 'work'"]
    assert work.level == DiagnosticStatus.WARN
    assert work.message.endswith("over budget, 0 dropped")
    # Of the last second, in which the process may have been preempted.
    wait_until(lambda: float(values("timed: /worker")["busy"]) > 0.03, "the share")
    assert values("timed: /worker")["slowest"].startswith("timer 'work' ")
    assert int(values("timed: /sink")["queue_drops"]) > 0
    assert re.match(r"\d+ times, mean .* 0 over 10000 ms", values("timed")["chain through"])


# The last one: it ends the system.
def test_the_summary_at_the_end(system: CommandProcess) -> None:
    line = system.wait_for(r"timer 'work' took .* over its budget of 20 ms")
    assert "[WARN] [worker]" in line
    code, _ = system.stop()
    assert code == 0
    rows = [line for line in system.lines if line.startswith(("/worker ", "/sink "))]
    work = next(row for row in rows if "timer 'work'" in row)
    count, mean_ms, p99_ms, longest_ms = map(float, re.findall(r"[\d.]+", work)[:4])
    assert count >= ENOUGH
    assert 5.0 <= mean_ms < p99_ms * 1.1 <= longest_ms * 1.1 * 1.1
    assert longest_ms >= 40.0
    assert any("subscription 'burst'" in row for row in rows)
    assert re.search(r"chain through: \d+ times, mean", system.output)
