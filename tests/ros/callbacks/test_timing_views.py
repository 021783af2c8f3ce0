"""Figures of callbacks and chains are right, and the same in every view."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from tests.ros.support.commands import output_of
from tests.ros.support.in_process import Peer, wait_until
from tests.ros.support.system_process import RunningSystem

SYSTEM = """
system: timed
nodes:
  worker:
    behavior: timed:Worker
    timers: {work: {period_ms: 100, budget_ms: 20}}
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
) -> Iterator[RunningSystem]:
    path = tmp_path_factory.mktemp("timed") / "timed.yaml"
    path.write_text(SYSTEM, encoding="utf-8")
    path.with_name("timed.py").write_text(BEHAVIORS, encoding="utf-8")
    with RunningSystem(str(path)) as running:
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


def test_compose_top_and_compose_ps(system: RunningSystem) -> None:
    wait_until(lambda: verify(compose("top", "--once", "--json")["callbacks"]), "calls")
    (status,) = compose("ps", "--json")["systems"]
    assert verify(
        [item | {"node": node["node"]} for node in status["nodes"] for item in node["callbacks"]]
    )
    (chain,) = status["chains"]
    assert (chain["chain"], chain["late"]) == ("through", 0)
    assert 0.0 < chain["mean_ms"] <= chain["longest_ms"] < 10_000.0


def test_diagnostics(system: RunningSystem, peer: Peer) -> None:
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
def test_the_summary_at_the_end(system: RunningSystem) -> None:
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
