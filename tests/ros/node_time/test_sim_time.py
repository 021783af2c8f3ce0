"""Nodes in simulated time follow /clock only."""

from __future__ import annotations

import itertools
import threading
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import Log
from std_msgs.msg import Header, String

from composer.client.parameters import ParameterClient
from composer.client.session import Deadline, Session
from composer.runtime.supervision.events import CallbackFailed
from tests.ros.support.in_process import Peer, RunningSystem, running, wait_until
from tests.ros.support.simulator import NANOSECONDS, Simulator, listeners

KINDS = ["events", "multi_threaded"]
SYSTEM = """
system: simulated
executors: {{default: {{kind: {kind}}}}}
use_sim_time: true
nodes:
  a:
    timers:
      simulated: {{period_ms: 100, log: "at {{now}}"}}
      real: {{period_ms: 10, clock: steady, log: "real"}}
"""


def ticks(system: RunningSystem) -> list[float]:
    """Return when the timer in simulated time was called."""
    return [float(line.removeprefix("at ")) for line in system.log() if line.startswith("at ")]


def wait_for_ticks(system: RunningSystem, *times_s: float) -> None:
    """Wait until the timer was called at these times and waits again."""
    wait_until(lambda: ticks(system) == list(times_s), f"calls at {times_s}")
    wait_for_timer(system)


def wait_for_timer(system: RunningSystem) -> None:
    """Wait until the timer in simulated time waits: it would miss an earlier jump.

    It does once the callbacks have returned that ran until now.
    """
    node, have_returned = system.node("a"), threading.Event()
    node.loop.call_soon(partial(node.contexts[0].strand.post, have_returned.set))
    wait_until(have_returned.is_set, "a timer that waits")


def let_real_time_pass(system: RunningSystem) -> None:
    """Wait until the timer in real time was called a few more times."""
    before = system.log().count("real")
    wait_until(lambda: system.log().count("real") >= before + 5, "a timer on the steady clock")


@pytest.mark.parametrize("kind", KINDS)
def test_timers_start_pause_and_jump_with_the_clock(tmp_path: Path, peer: Peer, kind: str) -> None:
    with running(SYSTEM.format(kind=kind), tmp_path) as system:
        let_real_time_pass(system)
        assert system.node("a").now_s() == 0.0
        simulator = Simulator(peer, system)
        simulator.set_time(1000.0)  # the first time: the first period begins
        let_real_time_pass(system)
        assert ticks(system) == []
        simulator.set_time(1000.05, 1000.1)
        wait_for_ticks(system, 1000.1)
        let_real_time_pass(system)  # a pause
        simulator.set_time(1100.1)  # far ahead
        wait_for_ticks(system, 1000.1, 1100.1)
        let_real_time_pass(system)
        simulator.set_time(1100.15, 1100.2)
        wait_for_ticks(system, 1000.1, 1100.1, 1100.2)
        simulator.set_time(7.0, 7.05)  # back
        let_real_time_pass(system)
        simulator.set_time(7.1)
        wait_for_ticks(system, 1000.1, 1100.1, 1100.2, 7.1)
        let_real_time_pass(system)
        assert len(ticks(system)) == 4
        for _ in range(20):
            simulator.set_invalid_time()  # it is ignored, with one warning
            let_real_time_pass(system)
        simulator.set_time(8.0)
        assert system.node("a").now_s() == 8.0
        (warning,) = [line for line in system.log() if "/clock" in line]
        assert warning == "ignored a time of /clock: Seconds value must not be negative"
        assert system.reported(CallbackFailed) == []


@pytest.mark.parametrize(("kind", "factor"), [("events", 1.0), ("multi_threaded", 10.0)])
def test_timers_are_as_fast_as_the_clock(
    tmp_path: Path, peer: Peer, kind: str, factor: float
) -> None:
    with running(SYSTEM.format(kind=kind), tmp_path) as system:
        simulator = Simulator(peer, system)
        with simulator.runs(1_700_000_000.0, factor):
            wait_until(lambda: len(ticks(system)) >= 11)
        found = ticks(system)
    # Even if the first call is late, the next ones are due at multiples of the period.
    assert found[10] - found[0] >= 0.899
    gaps_s = [late - early for early, late in itertools.pairwise(found)]
    assert min(gaps_s) > 0.0
    assert median(gaps_s) < 0.9  # by real time it would be 1 s with the factor 10


SLEEPER = """
from composer.behavior import Behavior, CallCancelled

class Sleeper(Behavior):
    async def on_go(self, message):
        self.log.info(f"asleep {self.clock.now()}")
        try:
            await self.clock.sleep(5.0)
        except CallCancelled:
            self.log.info("woken")
            raise
        self.log.info(f"awake {self.clock.now()}")
"""
SLEEPING = """
system: sleeping
executors: {{default: {{kind: {kind}}}}}
nodes:
  a:
    behavior: sleeper:Sleeper
    parameters: {{use_sim_time: true}}
    subscriptions: {{go: {{type: std_msgs/msg/String, external: true}}}}
    timers: {{real: {{period_ms: 10, clock: steady, log: "real"}}}}
"""


@pytest.mark.parametrize("kind", KINDS)
def test_a_coroutine_sleeps_in_simulated_time_until_deactivation(
    tmp_path: Path, peer: Peer, kind: str
) -> None:
    with running(SLEEPING.format(kind=kind), tmp_path, sleeper=SLEEPER) as system:
        go = peer.publisher(String, "/go")
        go.publish(String())  # before the first time
        system.wait_for_log("asleep 0.0")
        let_real_time_pass(system)
        simulator = Simulator(peer, system)
        simulator.set_time(40.0)
        assert peer.change("/a", "deactivate")
        system.wait_for_log("woken")
        simulator.set_time(50.0)
        assert peer.change("/a", "activate")
        let_real_time_pass(system)
        assert "awake" not in system.log_text()
        go.publish(String())
        system.wait_for_log("asleep 50.0")
        let_real_time_pass(system)
        simulator.set_time(54.9)
        let_real_time_pass(system)
        assert "awake" not in system.log_text()
        simulator.set_time(55.0)
        system.wait_for_log("awake 55.0")
        go.publish(String())
        system.wait_for_log("asleep 55.0")
        let_real_time_pass(system)  # until it sleeps
        simulator.set_time(10.0, 14.0)  # it does not sleep until 60
        let_real_time_pass(system)
        assert system.log_text().count("awake") == 1
        simulator.set_time(15.0)
        system.wait_for_log("awake 15.0")
        assert system.reported(CallbackFailed) == []


@pytest.mark.parametrize("kind", KINDS)
def test_the_parameter_switches_a_running_node(tmp_path: Path, peer: Peer, kind: str) -> None:
    with running(SYSTEM.format(kind=kind), tmp_path) as system:
        simulator = Simulator(peer, system)
        simulator.set_time(20.0)
        assert peer.set_parameter("/a", "use_sim_time", False) == ""
        wait_until(lambda: len(ticks(system)) >= 3, "calls in real time")
        assert min(ticks(system)) > 1e9
        assert peer.set_parameter("/a", "use_sim_time", True) == ""
        wait_for_timer(system)
        simulator.set_time(30.0)  # it was 20 for the other nodes
        wait_until(lambda: ticks(system)[-1] == 30.0)
        wait_for_timer(system)
        before = len(ticks(system))
        let_real_time_pass(system)
        simulator.set_time(30.1)
        wait_until(lambda: ticks(system)[before:] == [30.1])
        wait_for_timer(system)
        assert "bool" in peer.set_parameter("/a", "use_sim_time", "yes").lower()
        simulator.set_time(30.2)
        wait_until(lambda: ticks(system)[before:] == [30.1, 30.2])


def test_a_sleeping_coroutine_follows_a_switch_of_time(tmp_path: Path, peer: Peer) -> None:
    module = SLEEPER.replace("sleep(5.0)", "sleep(0.05)")
    with running(SLEEPING.format(kind="events"), tmp_path, sleeper=module) as system:
        go = peer.publisher(String, "/go")
        go.publish(String())
        system.wait_for_log("asleep 0.0")
        assert peer.set_parameter("/a", "use_sim_time", False) == ""
        system.wait_for_log("awake 1")  # some time since 1970
        assert peer.set_parameter("/a", "use_sim_time", True) == ""
        go.publish(String())
        wait_until(lambda: system.log().count("asleep 0.0") == 2)
        let_real_time_pass(system)
        assert system.log_text().count("awake") == 1


MANY = """
system: many
nodes:
  for_${number}: {for_each: {number: 4}, parameters: {use_sim_time: true}}
  real: {}
"""


def test_one_subscription_serves_all_nodes_and_is_destroyed_with_the_last(
    tmp_path: Path, peer: Peer
) -> None:
    with running(MANY, tmp_path) as system:
        wait_until(lambda: [end.node_name for end in listeners(peer)] == ["manager"])
        simulator = Simulator(peer, system)
        for number in range(4):
            simulator.set_time(100.0 + number, node=f"for_{number}")
        assert system.node("real").now_s() > 1e9
        for number in range(4):
            assert listeners(peer) != []
            assert peer.set_parameter(f"/for_{number}", "use_sim_time", False) == ""
        wait_until(lambda: listeners(peer) == [])
        assert peer.set_parameter("/real", "use_sim_time", True) == ""
        simulator = Simulator(peer, system)
        assert system.node("real").now_s() == 0.0  # the old time is outdated
        simulator.set_time(200.0, node="real")


STAMPED = """
system: stamped
use_sim_time: true
introspection: {parameters: false}
nodes:
  a:
    publishers: {output: {type: std_msgs/msg/Header, external: true}}
    timers: {beat: {period_ms: 100, log: "beat", publish: {output: {stamp: "{now}"}}}}
    introspection: {rosout: true}
  wall: {parameters: {use_sim_time: false}}
"""


#: From the first published time on; the real time is far from it.
SIMULATED_NS = range(1000 * NANOSECONDS, 10**9 * NANOSECONDS)


def stamp_ns(message: Any) -> int:
    """Return the time in a header or a stamp."""
    return int(message.stamp.sec * NANOSECONDS + message.stamp.nanosec)


def test_stamps_are_simulated_and_use_sim_time_changes_at_run_time(
    tmp_path: Path, peer: Peer
) -> None:
    with running(STAMPED, tmp_path) as system:
        received = peer.listen(Header, "/output")
        logged = peer.listen(Log, "/rosout")
        arrays = peer.listen(DiagnosticArray, "/diagnostics")
        simulator = Simulator(peer, system)
        tenths = itertools.count(10_000)

        def is_published_by_all() -> object:
            """Wait a tenth of a second: messages before discovery are lost."""
            simulator.set_time(next(tenths) / 10)
            stamps_ns = [stamp_ns(array.header) for array in arrays]
            return received and logged and any(stamp in SIMULATED_NS for stamp in stamps_ns)

        wait_until(is_published_by_all)
        for message in (*received, *logged):
            assert stamp_ns(message) in SIMULATED_NS
            assert stamp_ns(message) % (NANOSECONDS // 10) == 0
        with Session() as session:  # neither node has parameter services
            a, wall = (ParameterClient(session, Deadline(20.0), name) for name in ("/a", "/wall"))
            values = [client.values(["use_sim_time"])["use_sim_time"] for client in (a, wall)]
            assert values == [True, False]
            a.set({"use_sim_time": False})
        wait_until(lambda: received[-1].stamp.sec > 10**9, "a stamp of today")


def test_a_parameter_file_sets_it_for_all_nodes(tmp_path: Path, peer: Peer) -> None:
    tmp_path.joinpath("simulation.yaml").write_text("/**: {ros__parameters: {use_sim_time: true}}")
    text = "system: files\nparameter_files: [simulation.yaml]\nnodes: {a: {}, b: {}}\n"
    with running(text, tmp_path) as system:
        simulator = Simulator(peer, system)
        simulator.set_time(5.0, node="a")
        simulator.set_time(6.0, node="b")


WATCHED = """
system: watched
nodes:
  a:
    parameters: {use_sim_time: true, period_ms: 20.0}
    lifecycle: {watch: {topic_silence_ms: 500}}
    publishers: {output: {type: std_msgs/msg/Header, external: true}}
    timers:
      beat: {period_ms: "{parameters.period_ms}", publish: {output: {}}}
      real: {period_ms: 125, clock: steady, log: "real"}
"""


def test_silence_counts_while_the_simulation_runs(tmp_path: Path, peer: Peer) -> None:
    with running(WATCHED, tmp_path) as system:
        simulator = Simulator(peer, system)
        let_real_time_pass(system)  # no time yet
        simulator.set_time(10.0, 10.02)
        let_real_time_pass(system)  # a pause
        simulator.set_time(99.0)  # a jump
        let_real_time_pass(system)
        simulator.set_time(5.0)
        let_real_time_pass(system)
        assert system.states("/a") == ["/a inactive", "/a active"]
        assert peer.set_parameter("/a", "period_ms", 1e6) == ""
        with simulator.runs(100.0, 1.0):
            wait_until(lambda: "/a unconfigured" in system.states(), "the node has failed")


def test_a_node_that_blocks_its_loop_does_not_block_the_time_of_others(
    tmp_path: Path, peer: Peer
) -> None:
    text = """
    system: held
    use_sim_time: true
    executors: {other: {}}
    nodes:
      a: {executor: other}
      b: {behavior: holding:Holding, timers: {hold: {period_ms: 10, clock: steady}}}
    """
    module = """
    import threading
    from composer.behavior import Behavior

    LET_GO = threading.Event()

    class Holding(Behavior):
        def on_hold(self):
            self.log.info("holding")
            LET_GO.wait(20.0)
    """
    with running(text, tmp_path, holding=module) as system:
        system.wait_for_log("holding")
        let_go = system.behavior("b").on_hold.__globals__["LET_GO"]
        assert isinstance(let_go, threading.Event)
        try:
            Simulator(peer, system).set_time(1.0, 2.0)
        finally:
            let_go.set()
