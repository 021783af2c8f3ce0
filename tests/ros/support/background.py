"""A small system that runs in the background, and requests to it."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import time
from contextlib import suppress
from pathlib import Path

from tests.ros.support.commands import compose, listed, output_of, repeated_until

#: For commands that are sent once: a process may not be scheduled for a moment.
PATIENTLY = ("--timeout", "20")
ROBOT = """
system: robot
namespace: fleet
nodes:
  motor: {lifecycle: {depends_on: [planner]}, on_activate: {log: go}}
  planner:
    behavior: planner:Planner
    parameters: {fault: {type: string, default: ""}}
    publishers: {plan: {type: std_msgs/msg/String, qos: command, external: true}}
    timers: {tick: {rate_hz: 20, publish: {plan: {data: "{count} steps"}}}}
  webcam: {name: camera, lifecycle: {autostart: inactive}, on_activate: {log: go}}
"""
PLANNER = """
import time
from composer.behavior import Behavior

class Planner(Behavior):
    def on_configure(self):
        if self.parameters.fault == "configure":
            raise ValueError("no map")

    def on_activate(self):
        if self.parameters.fault == "hang":
            time.sleep(60.0)
"""


class Robot:
    """The system in the background."""

    def __init__(self, path: Path, *options: object) -> None:
        self.path = path
        self.began_s = time.time()
        self.text = output_of("run", path, "--wait", "--timeout", 20, *options)
        found = re.search(r"\(process (\d+), log (.*)\)", self.text)
        assert found is not None
        self.pid, self.log = int(found[1]), Path(found[2])

    def states(self) -> dict[str, str]:
        text = listed(('"nodes": [\n',), "ps", self.path, "--json", *PATIENTLY)
        system = json.loads(text)["systems"][0]
        return {node["node"]: node["state"] for node in system["nodes"]}

    def messages(self, *after: str) -> list[str]:
        """Return the messages in its log, which is written after the commands have ended."""
        command = ("logs", "--system", "robot", "--json")
        text = repeated_until(lambda text: all(f'"{part}"' in text for part in after), *command)
        return [json.loads(line)["message"] for line in text.splitlines()]

    def kill(self, number: signal.Signals = signal.SIGKILL) -> None:
        with suppress(ProcessLookupError):
            os.kill(self.pid, number)

    def is_alive(self) -> bool:
        try:
            os.kill(self.pid, 0)
        except ProcessLookupError:
            return False
        return True


def set_fault(fault: str) -> None:
    assert listed((fault,), "param", "set", "/fleet/planner", "fault", fault)


def lifecycle_set(*words: str) -> subprocess.CompletedProcess[str]:
    """Send the request, once."""
    return compose("lifecycle", "set", *words, *PATIENTLY)


def moved(*words: str) -> str:
    """Send a request that must succeed; return the output."""
    done = lifecycle_set(*words)
    assert done.returncode == 0, done.stderr
    return done.stdout


def refused(*arguments: object) -> str:
    """Run a command that must fail; return its stderr."""
    done = compose(*arguments)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "composer/runtime" not in done.stderr  # no traceback, except one of user code
    return done.stderr
