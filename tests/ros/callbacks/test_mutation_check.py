"""``--check-mutation`` names the callbacks that change shared messages, and no others."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from composer.runtime.host_options import HostOptions
from tests.ros.support.in_process import running, wait_until
from tests.ros.support.system_process import RunningSystem as InAProcess

TEXT = """
system: changing
nodes:
  source:
    behavior: changing:Source
    publishers:
      numbers: {type: std_msgs/msg/Int64}
      texts: {type: std_msgs/msg/String}
    timers: {tick: {period_ms: 20}, tock: {period_ms: 20}}
  forger:
    behavior: changing:Forger
    subscriptions: {numbers: {type: std_msgs/msg/Int64}}
  reader:
    behavior: changing:Reader
    subscriptions: {numbers: {type: std_msgs/msg/Int64}, texts: {type: std_msgs/msg/String}}
"""
MODULE = """
from composer.behavior import Behavior
from std_msgs.msg import Int64, String

class Source(Behavior):
    def on_configure(self):
        self.text = String()

    def on_tick(self):
        self.publishers.numbers.publish(Int64(data=1))

    def on_tock(self):
        self.text.data += "x"  # published before
        self.publishers.texts.publish(self.text)

class Forger(Behavior):
    async def on_numbers(self, message):
        await self.clock.sleep(0.001)
        message.data = 2

class Reader(Behavior):
    def on_configure(self):
        self.received = 0

    def on_numbers(self, message):
        self.received += 1

    def on_texts(self, message):
        self.received += 1
"""
FORGERY = "subscription 'numbers': modified a message (Int64) after it was received by 'numbers'"
USED_AGAIN = "timer 'tock': modified a message (String) after it was published by 'texts'"


@pytest.mark.parametrize("checks", [True, False])
def test_callbacks_that_change_a_message_are_named_if_it_is_checked(
    tmp_path: Path, checks: bool
) -> None:
    options = HostOptions(check_mutation=checks)
    with running(TEXT, tmp_path, options=options, changing=MODULE) as system:
        for line in (FORGERY, USED_AGAIN) if checks else ():
            system.wait_for_log(line)
        reader = system.behavior("reader")
        wait_until(lambda: reader.received > 10)
        faulty = {entry.node for entry in system.stop().nodes if entry.errors}
    assert faulty == ({"/forger", "/source"} if checks else set())
    named = [line for line in system.log() if "modified a message" in line]
    assert bool(named) is checks
    assert all(line.startswith((FORGERY, USED_AGAIN)) for line in named)


def test_the_option_of_the_command_line(tmp_path: Path) -> None:
    path = tmp_path / "changing.yaml"
    path.write_text(TEXT, encoding="utf-8")
    path.with_name("changing.py").write_text(MODULE, encoding="utf-8")
    with InAProcess(str(path), "--check-mutation") as system:
        line = system.wait_for(re.escape(FORGERY))
        assert "[ERROR] [forger]" in line
        system.wait_for(re.escape(USED_AGAIN))
        code, _ = system.stop()
    assert code == 0
    assert "[reader]" not in system.output
