"""When the callbacks of a node run: one at a time, unless they are reentrant."""

from __future__ import annotations

import gc
import warnings
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from std_msgs.msg import Int64

from composer.runtime.callbacks.callback import CallbackTimer
from composer.runtime.callbacks.user_code import UserCode
from composer.runtime.clock import COMPUTER
from composer.runtime.executors.strand import ExclusiveStrand
from composer.runtime.metrics.statistics import CallbackStatistics
from tests.ros.support.in_process import Peer, running

SLOW = """
system: slow
nodes:
  source:
    behavior: slow:Source
    publishers: {output: {type: std_msgs/msg/Int64, topic: input}}
  slow:
    behavior: slow:Slow
    subscriptions:
      input: {type: std_msgs/msg/Int64, external: true, qos: {depth: 2}}
      overlap: {type: std_msgs/msg/Int64, external: true, reentrant: true}
      release: {type: std_msgs/msg/Int64, external: true}
"""
SLOW_MODULE = """
from composer.behavior import Behavior

class Source(Behavior):
    pass

class Slow(Behavior):
    def on_configure(self):
        self.free = False

    async def on_input(self, message):
        self.log.info(f"begin {message.data}")
        while not self.free:
            await self.clock.sleep(0.001)
        self.log.info(f"end {message.data}")

    on_overlap = on_input

    def on_release(self, message):
        self.free = True
"""


def test_messages_wait_while_a_handler_awaits_unless_it_is_reentrant(
    tmp_path: Path, peer: Peer
) -> None:
    """The queue holds two messages: the oldest ones are dropped."""
    with running(SLOW, tmp_path, slow=SLOW_MODULE) as system:
        source, release = system.sender("source", "output"), peer.publisher(Int64, "/release")
        overlapping = peer.publisher(Int64, "/overlap")
        for number in range(10, 14):
            overlapping.publish(Int64(data=number))
            system.wait_for_log(f"begin {number}")
        source.publish(Int64(data=0))
        system.wait_for_log("begin 0")
        for number in range(1, 5):
            source.publish(Int64(data=number))
        assert "end" not in system.log_text()
        release.publish(Int64())
        for number in (4, *range(10, 14)):
            system.wait_for_log(f"end {number}")
        counted = system.summary("/slow")
    words = [f"{word} {number}" for number in (0, 3, 4) for word in ("begin", "end")]
    assert [line for line in system.log() if int(line.split()[1]) < 10] == words
    assert counted.dropped == 2


@pytest.mark.parametrize("kind", ["events", "multi_threaded"])
def test_messages_that_arrive_while_a_node_is_inactive_do_not_wait_for_it(
    tmp_path: Path, kind: str
) -> None:
    """An earlier handler still awaits, so that messages stay in the queue.

    Nothing of it may be left for when the node is active again.
    """
    text = f"""
    system: resting
    executors: {{chosen: {{kind: {kind}}}}}
    nodes:
      source:
        executor: chosen
        behavior: resting:Source
        publishers: {{output: {{type: std_msgs/msg/Int64, topic: /numbers}}}}
      sink:
        executor: chosen
        behavior: resting:Sink
        subscriptions: {{input: {{type: std_msgs/msg/Int64, topic: /numbers}}}}
    """
    module = """
    from composer.behavior import Behavior
    from rclpy.task import Future

    class Source(Behavior):
        pass

    class Sink(Behavior):
        def on_configure(self):
            self.release = Future()

        async def on_input(self, message):
            self.log.info(f"begin {message.data}")
            await self.release
            self.log.info(f"end {message.data}")
    """
    with running(text, tmp_path, resting=module) as system:
        output = system.sender("source", "output")
        output.publish(Int64(data=0))
        system.wait_for_log("begin 0")
        system.change("sink", "deactivate")
        output.publish(Int64(data=1))
        output.publish(Int64(data=2))
        system.change("sink", "activate")
        output.publish(Int64(data=3))
        assert "begin 3" not in system.log_text()  # one at a time, including earlier ones
        system.behavior("sink").release.set_result(None)
        system.wait_for_log("end 3")
        counted = system.summary("/sink")
    words = [f"{word} {number}" for number in (0, 3) for word in ("begin", "end")]
    assert [line for line in system.log() if line in words or line.startswith("begin")] == words
    assert (counted.received, counted.dropped) == (2, 2)


def test_on_several_threads_only_reentrant_callbacks_run_at_once(
    tmp_path: Path, peer: Peer
) -> None:
    text = """
    system: turns
    executors: {several: {kind: multi_threaded, threads: 4}}
    nodes:
      source:
        behavior: turns:Source
        publishers: {output: {type: std_msgs/msg/Int64, topic: /numbers}}
      overlapping:
        executor: several
        behavior: turns:Overlapping
        subscriptions: {input: {type: std_msgs/msg/Int64, topic: /numbers, reentrant: true}}
      one_at_a_time:
        executor: several
        behavior: turns:OneAtATime
        subscriptions: {input: {type: std_msgs/msg/Int64, external: true}}
        timers: {tick: {period_ms: 2}, async_tick: {period_ms: 2}}
    """
    module = """
    import threading
    from time import sleep
    from composer.behavior import Behavior

    class Source(Behavior):
        pass

    class Overlapping(Behavior):
        def on_configure(self):
            self.both = threading.Barrier(2, timeout=60.0)

        def on_input(self, message):
            self.both.wait()
            self.log.info(f"met {message.data}")

    class OneAtATime(Behavior):
        def on_configure(self):
            self.inside = self.most = self.calls = 0

        def work(self):
            self.inside += 1
            self.most = max(self.most, self.inside)
            sleep(0.001)
            self.inside -= 1
            self.calls += 1
            if self.calls == 300:
                self.log.info(f"at most {self.most} at once")

        def on_input(self, message): self.work()
        def on_tick(self): self.work()
        async def on_async_tick(self):
            self.work()
            await self.clock.sleep(0.001)
            self.work()
    """
    with running(text, tmp_path, turns=module) as system:
        output, source = system.sender("source", "output"), peer.publisher(Int64, "/input")
        for number in range(2):
            output.publish(Int64(data=number))
        for number in range(50):
            source.publish(Int64(data=number))
        for number in range(2):
            system.wait_for_log(f"met {number}")
        assert system.wait_for_log("at once") == "at most 1 at once"


def test_python_does_not_warn_of_a_handler_that_is_canceled_before_it_begins() -> None:
    """It waits for its turn when the node is cleaned up."""

    async def handler() -> None:
        raise AssertionError("it does not begin")

    loop: Any = SimpleNamespace(clock=COMPUTER, call_soon=None, is_parallel=False)
    context: Any = SimpleNamespace(
        loop=loop, mutations=None, log=None, statistics=SimpleNamespace(tracing=True)
    )
    timer = CallbackTimer(context, CallbackStatistics("timer", "tick"), None)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        rest = timer.finish(0.0, UserCode().continuation("on_tick", handler()))
        assert rest is not None
        ExclusiveStrand(loop).wrap(rest).close()
        del rest
        gc.collect()
    assert not caught
