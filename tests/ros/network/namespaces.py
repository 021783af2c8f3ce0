"""Computers on one network, made of Linux namespaces and joined by a bridge.

Each has its own network, processes, host name, shared memory and runtime folder, and sees the files
of this computer. Nothing has a name outside: when this process ends, however it does, the kernel
ends every process of the network and removes its devices.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

import pytest

from tests.programs import require

PATIENCE_S = 60.0
_UNSHARE = ("unshare", "--net", "--mount", "--uts", "--pid", "--fork")
#: Private to each computer: runtime folder, temporary files, home and logs are below it.
RUN = Path("/run")
#: The first process of a computer. It mounts what is private, and reaps orphans: all of the
#: computer's processes end with it.
_INIT = """
import os, signal, subprocess, sys
subprocess.run(["mount", "-t", "tmpfs", "tmpfs", "/dev/shm"], check=True)
subprocess.run(["mount", "-t", "tmpfs", "-o", "mode=755", "tmpfs", "/run"], check=True)
for folder in ("user", "tmp", "home", "log", "sshd"):
    os.mkdir(f"/run/{folder}", 0o700)
subprocess.run(["ip", "link", "set", "lo", "up", "multicast", "on"], check=True)
if sys.argv[1] == "bridge":
    bridge = ["ip", "link", "add", "bridge", "type", "bridge", "mcast_snooping", "0"]
    subprocess.run(bridge, check=True)
    subprocess.run(["ip", "link", "set", "bridge", "up"], check=True)
subprocess.run(["hostname", sys.argv[1]], check=True)
signal.signal(signal.SIGCHLD, signal.SIG_IGN)
print("ready", flush=True)
while True:
    signal.pause()
"""
#: What processes on the computers do not inherit: the settings of tests on this computer only.
_NOT_INHERITED = (
    "FASTRTPS_DEFAULT_PROFILES_FILE",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_DOMAIN_ID",
)


def wait_until(condition: Callable[[], object], what: str) -> None:
    """Wait until a condition holds; fail with a text after a minute."""
    end_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end_s, what
        time.sleep(0.1)  # poll: each look is a process


def require_namespaces() -> None:
    """Skip the test where namespaces cannot be made; fail where only programs are missing in CI."""
    if os.geteuid() != 0:
        pytest.skip("network namespaces need root")
    made = subprocess.run([*_UNSHARE, "true"], check=False, capture_output=True)
    if made.returncode != 0:
        pytest.skip(f"namespaces are not permitted: {made.stderr.decode().strip()}")
    require_programs("ip", package="iproute2")


def require_programs(*programs: str, package: str) -> None:
    """Skip the test if a program is missing; fail in CI."""
    missing = [program for program in programs if shutil.which(program) is None]
    require(not missing, f"not installed: {', '.join(missing)} (package {package})")


class Namespaces:
    """The namespaces of one computer, or of the bridge between them."""

    def __init__(self, name: str) -> None:
        self.name = name
        # --kill-child ends the first process, and so all others, with unshare; setpriv ends that
        # with this process.
        unshare = (*_UNSHARE, "--kill-child", "--mount-proc")
        first = (sys.executable, "-I", "-S", "-c", _INIT, name)
        self._first = subprocess.Popen(
            ["setpriv", "--pdeathsig", "KILL", *unshare, *first], stdout=subprocess.PIPE, text=True
        )
        assert self._first.stdout is not None
        assert self._first.stdout.readline() == "ready\n", f"{name} did not start"
        children = Path(f"/proc/{self._first.pid}/task/{self._first.pid}/children")
        self.pid = int(children.read_text().split()[0])

    def command(self, *words: str) -> list[str]:
        """Return the command that runs ``words`` there."""
        options = ("--net", "--mount", "--uts", "--pid", f"--target={self.pid}")
        return ["nsenter", *options, f"--wd={Path.cwd()}", "--", *words]

    def set_up(self, *words: str) -> None:
        """Change its network devices. It can name the namespaces of other computers."""
        command = ["nsenter", "--net", f"--target={self.pid}", "--", *words]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        assert done.returncode == 0, f"{words}: {done.stderr}"

    def end(self) -> None:
        """End all its processes at once."""
        self._first.kill()
        self._first.wait()


@dataclass(frozen=True)
class Quality:
    """How long packets take over a link, in milliseconds, and how many are lost, in percent."""

    delay_ms: float = 0.0
    loss_percent: float = 0.0


PERFECT = Quality()


def _netem(device: str, quality: Quality) -> tuple[str, ...]:
    """Return the command that lets the kernel delay and lose what a device sends."""
    delay, loss = f"{quality.delay_ms:g}ms", f"{quality.loss_percent:g}%"
    return ("tc", "qdisc", "add", "dev", device, "root", "netem", "delay", delay, "loss", loss)


@cache
def has_netem() -> bool:
    """Return whether the kernel can delay and lose packets, as those of many computers cannot."""
    if shutil.which("tc") is None:
        return False
    command = ("unshare", "--net", *_netem("lo", Quality(1.0, 1.0)))
    return subprocess.run(command, check=False, capture_output=True).returncode == 0


class Computer(Namespaces):
    """A computer with a host name and an address."""

    def __init__(self, name: str, number: int, bridge: Namespaces, quality: Quality) -> None:
        super().__init__(name)
        self.address = f"10.77.0.{number}"
        self._port = f"port{number}"
        self._bridge = bridge
        self._wire: subprocess.Popen[str] | None = None
        if quality == PERFECT or has_netem():
            ends = ("type", "veth", "peer", "name", "eth0", "netns", str(self.pid))
            bridge.set_up("ip", "link", "add", self._port, *ends)
            if quality != PERFECT:
                bridge.set_up(*_netem(self._port, quality))
                self.set_up(*_netem("eth0", quality))
        else:
            self._wire = self._lay_wire(quality)
        bridge.set_up("ip", "link", "set", self._port, "master", "bridge", "up")
        self.set_up("ip", "address", "add", f"{self.address}/24", "dev", "eth0")
        self.set_up("ip", "link", "set", "eth0", "up")
        self.set_up("ip", "route", "add", "224.0.0.0/4", "dev", "eth0")

    def _lay_wire(self, quality: Quality) -> subprocess.Popen[str]:
        """Start a wire in place of a pair of devices and netem."""
        ends = (str(self._bridge.pid), self._port, str(self.pid), "eth0")
        numbers = (str(quality.delay_ms), str(quality.loss_percent))
        program = Path(__file__).with_name("wire.py")
        command = ("setpriv", "--pdeathsig", "KILL", sys.executable, "-I", "-S", str(program))
        wire = subprocess.Popen([*command, *ends, *numbers], stdout=subprocess.PIPE, text=True)
        assert wire.stdout is not None
        assert wire.stdout.readline() == "ready\n", "the wire does not work"
        return wire

    def end(self) -> None:
        """End all its processes at once, and its link."""
        super().end()
        if self._wire is not None:
            self._wire.kill()
            self._wire.wait()

    def environment(self, extra: Mapping[str, str] | None = None) -> dict[str, str]:
        """Return the environment of processes there."""
        kept = {key: text for key, text in os.environ.items() if key not in _NOT_INHERITED}
        return {**kept, **self.private_environment(), **(extra or {})}

    @staticmethod
    def private_environment() -> dict[str, str]:
        """Return the variables that name the folders of the computer."""
        return {
            "XDG_RUNTIME_DIR": f"{RUN}/user",
            "TMPDIR": f"{RUN}/tmp",
            "HOME": f"{RUN}/home",
            "ROS_LOG_DIR": f"{RUN}/log",
        }

    def start(self, *words: str, **options: Any) -> subprocess.Popen[str]:
        """Start a program there; it ends with the computer at the latest."""
        environment = self.environment(options.pop("env", None))
        return subprocess.Popen(self.command(*words), env=environment, text=True, **options)

    def run(self, *words: str, timeout_s: float = PATIENCE_S) -> subprocess.CompletedProcess[str]:
        """Run a program there; return its result, whatever the exit code."""
        return subprocess.run(
            self.command(*words),
            check=False,
            env=self.environment(),
            capture_output=True,
            text=True,
            timeout=timeout_s,
        )

    def check(self, *words: str, timeout_s: float = PATIENCE_S) -> str:
        """Run a program there that must succeed; return its output."""
        done = self.run(*words, timeout_s=timeout_s)
        assert done.returncode == 0, f"{words}: {done.stderr}{done.stdout}"
        return done.stdout

    def processes(self, part: str) -> dict[int, str]:
        """Return the processes there with ``part`` in their command line, by their ids there.

        Not the first one: the path of its Python may contain any part.
        """
        found = {}
        for line in self.check("ps", "-wweo", "pid=,args=").splitlines():
            pid, _, words = line.strip().partition(" ")
            if pid != "1" and part in words and not words.startswith("ps -wweo"):
                found[int(pid)] = words
        return found

    def cut(self) -> None:
        """Cut its link."""
        self._bridge.set_up("ip", "link", "set", self._port, "down")

    def join(self) -> None:
        """Restore its link."""
        self._bridge.set_up("ip", "link", "set", self._port, "up")

    def block_multicast(self) -> None:
        """Let no multicast of other computers reach it, as many networks do."""
        self._bridge.set_up(
            *("ip", "link", "set", self._port, "type", "bridge_slave", "mcast_flood", "off")
        )

    def kill_all(self) -> None:
        """End all processes there but the first one, at once."""
        # -1 is every process of the namespace but the first and the shell itself.
        self.run("sh", "-c", "kill -KILL -1")


@contextmanager
def network(names: Sequence[str], quality: Quality = PERFECT) -> Iterator[list[Computer]]:
    """Make computers with these host names on one network. Skips the test where it cannot."""
    require_namespaces()
    with ExitStack() as stack:
        bridge = Namespaces("bridge")
        stack.callback(bridge.end)
        computers = []
        for number, name in enumerate(names, start=1):
            computer = Computer(name, number, bridge, quality)
            stack.callback(computer.end)
            computers.append(computer)
        wait_for_links(computers)
        yield computers


def wait_for_links(computers: Sequence[Computer]) -> None:
    """Wait until all links forward packets."""
    for computer in computers:
        look = partial(computer.check, "ip", "link", "show", "dev", "eth0")
        wait_until(lambda look=look: "LOWER_UP" in look(), f"no link to {computer.name}")
