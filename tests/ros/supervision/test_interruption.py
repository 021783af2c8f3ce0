"""What interrupts a callback strikes what its user has written, and nothing else."""

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
    publishers: {said: {type: std_msgs/msg/String}}
    timers: {tick: {period_ms: 10}}
    lifecycle: {watch: {callback_ms: 50}}
  relay:
    executor: own
    subscriptions:
      said: {type: std_msgs/msg/String, external: true, publish: {heard: {data: "{message.data}"}}}
    publishers: {heard: {type: std_msgs/msg/String, external: true}}
"""
MODULE = """
from composer.behavior import Behavior

class Chatter(Behavior):
    def on_tick(self):
        message = self.publishers.said.message_type(data="on and on")
        while self.parameters.fault:
            self.publishers.said.publish(message)

    def on_deactivate(self):
        self.publishers.said.publish(self.publishers.said.message_type(data="a last word"))
"""


@pytest.mark.parametrize("kind", ["events", "multi_threaded"])
def test_what_is_called_of_ours_is_not_struck_but_the_user_who_calls_it(
    tmp_path: Path, peer: Peer, kind: str
) -> None:
    """The publisher that is called without end delivers to another node within the call."""
    with running(CHATTER.replace("KIND", kind), tmp_path, chatter=MODULE) as system:
        heard = peer.listen(String, "/heard")
        said = peer.publisher(String, "/said")
        assert peer.set_parameter("/chatter", "fault", "yes") == ""
        wait_until(lambda: system.told(NodeFailed), "the failure")
        assert system.told(NodeFailed)[0].reason == "on_tick took longer than 50 ms"
        assert "return from on_tick within 50 ms" in str(system.told(Stuck)[0])
        traceback = system.wait_for_log("CallbackInterrupted")
        frames = re.findall(r'File ".*?([^/"]+)", line \d+, in (\w+)', system.log_text())
        # A lookup of a publisher or a parameter changes nothing, and may be struck as well.
        where = [frame for frame in frames if frame[1] != "__getattr__"]
        assert where[-1] == ("chatter.py", "on_tick"), traceback
        wait_until(
            lambda: heard and heard[-1].data == "a last word", "it is asked to end, and may speak"
        )
        # Its neighbour hears the next who speaks.
        said.publish(String(data="your turn"))
        wait_until(lambda: heard[-1].data == "your turn", "the relay goes on")


NESTED = """
system: nested
lifecycle: {on_failure: isolate}
executors: {own: {kind: events}}
nodes:
  caller:
    executor: own
    behavior: nested:Caller
    publishers: {said: {type: std_msgs/msg/String}}
    timers: {tick: {period_ms: 20}}
    lifecycle: {watch: {callback_ms: 500}}
  relay:
    executor: own
    subscriptions: {said: {type: std_msgs/msg/String, publish: {passed: {data: "{message.data}"}}}}
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
        self.publishers.said.publish(self.publishers.said.message_type(data="go"))

class Hanging(Behavior):
    def on_passed(self, message):
        while True:
            pass
"""


def test_those_who_wait_for_a_callback_that_hangs_do_not_hang_themselves(tmp_path: Path) -> None:
    """It runs within a reaction, which runs within a callback; both could wait half as long."""
    with running(NESTED, tmp_path, nested=CALLER_AND_HANGING) as system:
        wait_until(lambda: "/hanging unconfigured" in system.states(), "it is isolated")
        failed = [(event.node, event.reason) for event in system.told(NodeFailed)]
        assert failed == [("/hanging", "on_passed took longer than 1000 ms")]
        assert system.states("/caller")[-1] == "/caller active"
        assert system.states("/relay")[-1] == "/relay active"


#: So often do threads take turns that whatever may come in between does.
OFTEN = "import sys; sys.setswitchinterval({interval_s}); from composer.cli import main; main()"


def test_nodes_of_many_threads_come_up_whatever_comes_in_between(tmp_path: Path) -> None:
    path = write_faulty_system(tmp_path)
    text = path.read_text(encoding="utf-8")
    patient = text.replace("_ms: 300", "_ms: 20000").replace("_ms: 2500", "_ms: 20000")
    path.write_text(patient, encoding="utf-8")
    program = (sys.executable, "-c", OFTEN.format(interval_s=1e-5))
    with RunningSystem(str(path), "--autostart", "active", program=program) as system:
        system.wait_for("17 of 17 nodes active after")
        assert "ERROR" not in system.output
