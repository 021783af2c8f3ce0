"""A system whose processes run on other computers of a network, and the commands that start it."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path

from tests.ros.network.namespaces import PATIENCE_S, Computer, wait_until
from tests.ros.network.ssh_servers import SshKeys

COMPOSE = (sys.executable, "-P", "-m", "composer")
#: On each computer, below what is private to it.
WORKSPACE = "/run/robot"
_DETECTOR = """
from composer.behavior import Behavior

class Detector(Behavior):
    def on_activate(self):
        self.log.info("looking")

    def on_image(self, message):
        found = self.publishers.found
        found.publish(found.message_type(data=f"found {message.data}"))
"""
_SYSTEM = """
system: robot
arguments:
  content: {default: picture}
lifecycle: {on_failure: restart, restart: {backoff_ms: 300}}
hosts:
HOSTS
processes:
  sensing: {nodes: [camera], host: robot}
  acting: {nodes: [detector], host: ACTING}
nodes:
  camera:
    publishers: {image: {type: std_msgs/msg/String, qos: command}}
    timers: {tick: {period_ms: 200, publish: {image: {data: "${content}"}}}}
  detector:
    behavior: detector:Detector
    subscriptions: {image: {type: std_msgs/msg/String, qos: command}}
    publishers: {found: {type: std_msgs/msg/String, qos: command}}
    lifecycle: {depends_on: [camera]}
  logger:
    subscriptions: {found: {type: std_msgs/msg/String, qos: command, log: "{message.data}"}}
    lifecycle: {depends_on: [detector]}
"""


class SplitSystem:
    """A project on the first computer, whose processes belong to the others."""

    def __init__(self, folder: Path, computers: Sequence[Computer], keys: SshKeys) -> None:
        self.console, *others = computers
        self.others = others
        lines = [
            f"  {item.name}: {{address: {item.address}, user: root, workspace: {WORKSPACE},"
            f" python: {sys.executable}, identity_file: {keys.login_key},"
            f" known_hosts: {keys.known_hosts}}}"
            for item in others
        ]
        text = _SYSTEM.replace("HOSTS", "\n".join(lines)).replace("ACTING", others[-1].name)
        folder.mkdir()
        self.path = folder / "robot.yaml"
        self.path.write_text(text, encoding="utf-8")
        folder.joinpath("detector.py").write_text(_DETECTOR, encoding="utf-8")
        folder.joinpath("composer.yaml").touch()

    def compose(self, *words: str) -> subprocess.CompletedProcess[str]:
        """Run a command on the first computer."""
        return self.console.run(*COMPOSE, *words, timeout_s=PATIENCE_S)

    def up(self, *options: str) -> UpOnHosts:
        """Start ``compose hosts run`` there."""
        return UpOnHosts(self, *options)

    def members(self) -> list[tuple[str, int]]:
        """Return the processes of the system on the other computers, but not their guards."""
        return [
            (item.name, pid)
            for item in self.others
            for pid, words in item.processes("--process").items()
            if "guard" not in words
        ]

    def all_processes(self) -> list[str]:
        """Return all processes of the composer on all computers."""
        found = (item.processes("-m composer").values() for item in (self.console, *self.others))
        return [words for each in found for words in each if not words.startswith("nsenter")]


class UpOnHosts:
    """A running ``compose hosts run``, with its output."""

    def __init__(self, system: SplitSystem, *options: str) -> None:
        self._system = system
        self.lines: list[str] = []
        command = (*COMPOSE, "hosts", "run", str(system.path), *options)
        self.process = system.console.start(
            *command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> UpOnHosts:
        return self

    def __exit__(self, kind: object, error: BaseException | None, traceback: object) -> None:
        if self.process.poll() is None:
            self.kill()
        if error is not None:
            error.add_note("compose hosts run printed:\n" + "\n".join(self.lines))

    def wait_for(self, part: str, after: int = 0) -> int:
        """Wait for a line that contains ``part`` after so many lines; return how many there are."""
        end_s = time.monotonic() + PATIENCE_S
        while True:
            has_ended = self.process.poll() is not None and not self._reader.is_alive()
            if any(part in line for line in self.lines[after:]):
                return len(self.lines)
            assert not has_ended, f"ended without '{part}'"
            assert time.monotonic() < end_s, f"no '{part}'"
            time.sleep(0.05)  # poll: lines are few

    def signal(self, number: signal.Signals) -> None:
        """Send a signal to the command, not to its children."""

        def is_sent() -> bool:  # it may not have started yet, or have ended meanwhile
            if self.process.poll() is not None:
                return True
            found = self._system.console.processes("hosts run")
            pids = [pid for pid, words in found.items() if "nsenter" not in words]
            # A child that has just been forked has the same command line.
            kill = ("kill", f"-{number.value}", str(min(pids, default=0)))
            return bool(pids) and self._system.console.run(*kill).returncode == 0

        wait_until(is_sent, "no process to send the signal to")

    def kill(self) -> None:
        """Kill the command, not its children; wait until it has ended."""
        self.signal(signal.SIGKILL)
        self.process.wait(PATIENCE_S)

    def stop(self) -> int:
        """End it as Ctrl-C does, and check that no process is left; return the exit code."""
        self.signal(signal.SIGINT)
        code = self.process.wait(PATIENCE_S)
        self._reader.join(PATIENCE_S)
        wait_until(lambda: not self._system.all_processes(), "processes are left")
        return code

    @property
    def output(self) -> str:
        """The output so far."""
        return "\n".join(self.lines)

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.lines.append(line.rstrip("\n"))
