"""A robot whose nodes are in three processes, for tests."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType

from composer.runtime.host_options import HostOptions
from tests.ros.support.forked import ForkedCommand
from tests.ros.support.in_process import PATIENCE_S, RunningSystem, running
from tests.ros.support.system_process import write_system

TEXT = """
system: robot
namespace: lab
lifecycle: {on_failure: restart, restart: {backoff_ms: 100}}
processes:
  sensing: {nodes: [camera], cpus: [0], environment: {ROLE: sensing}}
  acting: {}
nodes:
  camera:
    publishers: {image: {type: std_msgs/msg/String, qos: command}}
    timers: {tick: {period_ms: 50, publish: {image: {data: picture}}}}
  detector:
    process: acting
    behavior: detector:Detector
    parameters: {mood: ""}
    subscriptions: {image: {type: std_msgs/msg/String, qos: command}}
    publishers: {found: {type: std_msgs/msg/String, qos: command}}
    lifecycle: {depends_on: [camera], watch: {callback_ms: 300}}
  arm:
    subscriptions: {found: {type: std_msgs/msg/String, qos: command, log: "{message.data}"}}
    lifecycle: {depends_on: [detector]}
"""
#: The camera is in the process that coordinates the other one, which takes less to start.
TWO_PROCESSES = TEXT.replace(
    "  sensing: {nodes: [camera], cpus: [0], environment: {ROLE: sensing}}\n", ""
)
DETECTOR = """
import time
from composer.behavior import Behavior

class Detector(Behavior):
    def on_configure(self):
        if self.parameters.mood == "broken":
            raise ValueError("no lens")

    def on_image(self, message):
        while self.parameters.mood == "hang":
            time.sleep(0.01)
        if self.parameters.mood == "block":
            time.sleep(60.0)  # cannot be interrupted
        if self.parameters.mood == "angry":
            raise ValueError("no cat")
        found = self.publishers.found
        found.publish(found.message_type(data=f"found {message.data}"))

class Arm(Behavior):
    is_held = False

    async def on_deactivate(self):
        while self.is_held:
            await self.clock.sleep(0.01)
"""


def command_of(path: Path) -> tuple[str, ...]:
    return (sys.executable, "-m", "composer", "run", str(path))


@contextmanager
def members(path: Path, *names: str, **environment: str) -> Iterator[list[ForkedCommand]]:
    """Run processes of a system by hand, without a coordinator; end them as Ctrl-C does."""
    processes = [start_member(path, name, environment) for name in names]
    try:
        yield processes
    finally:
        for process in processes:
            process.send_signal(signal.SIGINT)
        for process in processes:
            process.wait(PATIENCE_S)


def start_member(
    path: Path, name: str, environment: Mapping[str, str] = MappingProxyType({})
) -> ForkedCommand:
    command = ("run", str(path), "--process", name)
    with Path(os.devnull).open("w", encoding="utf-8") as nothing:
        return ForkedCommand(
            *command, stdout=nothing, stderr=nothing, env=environment, chooses_profile=False
        )


@contextmanager
def split(
    folder: Path,
    text: str = TEXT,
    *,
    fail_on_error: bool = False,
    all_or_nothing: bool = False,
) -> Iterator[RunningSystem]:
    """Run the system as ``compose run`` does, with this process as the coordinating one."""
    path = write_system(folder, text)
    options = HostOptions(
        stop_within_s=20.0,
        member_command=command_of(path),
        fail_on_error=fail_on_error,
        all_or_nothing=all_or_nothing,
    )
    with running(text, folder, options=options, detector=DETECTOR) as system:
        yield system


def states(system: RunningSystem) -> set[str]:
    return {system.node(name).state for name in ("camera", "detector", "arm")}


def pid_of(system: RunningSystem, node: str) -> int:
    pid = system.node(node).pid
    assert pid is not None
    return int(pid)


def alive(pid: int) -> bool:
    return Path("/proc", str(pid)).exists()
