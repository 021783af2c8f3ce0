"""Interrupts of callbacks are raised in code of the user only."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest
from std_msgs.msg import String

from composer.runtime.supervision.events import NodeFailed, Stuck
from tests.ros.support.faulty_system import write_faulty_system
from tests.ros.support.in_process import Peer, running, wait_until
from tests.ros.support.system_process import RunningSystem

CHATTER = """
system: chat
lifecycle: {on_failure: isolate}
executors: {own: {kind: KIND}}
nodes:
  chatter:
    executor: own
    behavior: chatter:Chatter
    parameters: {fault: ""}
    publishers: {chat: {type: std_msgs/msg/String}}
    timers: {tick: {period_ms: 10}}
    lifecycle: {watch: {callback_ms: 200}}
  relay:
    executor: own
    subscriptions:
      chat: {type: std_msgs/msg/String, external: true, publish: {echo: {data: "{message.data}"}}}
    publishers: {echo: {type: std_msgs/msg/String, external: true}}
"""
MODULE = """
from composer.behavior import Behavior

class Chatter(Behavior):
    def on_tick(self):
        message = self.publishers.chat.message_type(data="on and on")
        while self.parameters.fault:
            self.publishers.chat.publish(message)

    def on_deactivate(self):
        self.publishers.chat.publish(self.publishers.chat.message_type(data="a last word"))
"""


@pytest.mark.parametrize("kind", ["events", "multi_threaded"])
def test_an_interrupt_is_raised_in_the_user_code_that_calls_the_composer(
    tmp_path: Path, peer: Peer, kind: str
) -> None:
    """The publisher in the endless loop delivers to another node within the call."""
    with running(CHATTER.replace("KIND", kind), tmp_path, chatter=MODULE) as system:
        echo = peer.listen(String, "/echo")
        chat = peer.publisher(String, "/chat")
        assert peer.set_parameter("/chatter", "fault", "yes") == ""
        wait_until(lambda: system.reported(NodeFailed), "the failure")
        assert system.reported(NodeFailed)[0].reason == "on_tick took longer than 200 ms"
        assert "return from on_tick within 200 ms" in str(system.reported(Stuck)[0])
        traceback = system.wait_for_log("CallbackInterrupted")
        frames = re.findall(r'File ".*?([^/"]+)", line \d+, in (\w+)', system.log_text())
        # Lookups of publishers and parameters have no side effects and may be interrupted.
        where = [frame for frame in frames if frame[1] != "__getattr__"]
        assert where[-1] == ("chatter.py", "on_tick"), traceback
        wait_until(lambda: echo and echo[-1].data == "a last word", "the message of on_deactivate")
        # The other node of the executor still receives messages.
        chat.publish(String(data="your turn"))
        wait_until(lambda: echo[-1].data == "your turn", "the relay still works")


NESTED = """
system: nested
lifecycle: {on_failure: isolate}
executors: {own: {kind: events}}
nodes:
  caller:
    executor: own
    behavior: nested:Caller
    publishers: {chat: {type: std_msgs/msg/String}}
    timers: {tick: {period_ms: 20}}
    lifecycle: {watch: {callback_ms: 500}}
  relay:
    executor: own
    subscriptions: {chat: {type: std_msgs/msg/String, publish: {passed: {data: "{message.data}"}}}}
    publishers: {passed: {type: std_msgs/msg/String}}
    lifecycle: {watch: {callback_ms: 500}}
  hanging:
    executor: own
    behavior: nested:Hanging
    subscriptions: {passed: {type: std_msgs/msg/String}}
    lifecycle: {watch: {callback_ms: 1000}}
"""
CALLER_AND_HANGING = """
from composer.behavior import Behavior

class Caller(Behavior):
    def on_tick(self):
        self.publishers.chat.publish(self.publishers.chat.message_type(data="go"))

class Hanging(Behavior):
    def on_passed(self, message):
        while True:
            pass
"""


def test_callbacks_that_wait_for_a_hanging_callback_are_not_interrupted(tmp_path: Path) -> None:
    """It runs within a reaction within a callback, which have half of its time limit."""
    with running(NESTED, tmp_path, nested=CALLER_AND_HANGING) as system:
        wait_until(lambda: "/hanging unconfigured" in system.states(), "the isolation")
        failed = [(*event.nodes, event.reason) for event in system.reported(NodeFailed)]
        assert failed == [("/hanging", "on_passed took longer than 1000 ms")]
        assert system.states("/caller")[-1] == "/caller active"
        assert system.states("/relay")[-1] == "/relay active"


#: Threads switch so often that all interleavings happen.
PROGRAM = "import sys; sys.setswitchinterval({interval_s}); from composer.cli import main; main()"


def test_nodes_on_many_threads_come_up_with_frequent_thread_switches(tmp_path: Path) -> None:
    path = write_faulty_system(tmp_path)
    text = path.read_text(encoding="utf-8")
    patient = text.replace("_ms: 300", "_ms: 20000").replace("_ms: 2500", "_ms: 20000")
    path.write_text(patient, encoding="utf-8")
    program = (sys.executable, "-c", PROGRAM.format(interval_s=1e-5))
    with RunningSystem(str(path), "--autostart", "active", program=program) as system:
        # On a busy machine, each switch of threads may have to wait for a processor.
        system.wait_for("17 of 17 nodes active after", timeout_s=150)
        assert "ERROR" not in system.output
