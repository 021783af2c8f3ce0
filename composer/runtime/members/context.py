"""What a process of the system needs from the coordinating one, and goals that it keeps."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from typing import Protocol

from rclpy.node import Node as RosNode

from composer.base.fast_dataclass import dataclass
from composer.model import LogLevel, PrimaryState, Process, System
from composer.model.hosts import own_enclave
from composer.plan import STOPPED, SystemGoals, system_goals
from composer.runtime.children.child_processes import ChildProcesses, Command
from composer.runtime.executors.loop import Loop
from composer.runtime.middleware.environment import CONSOLE_FORMAT
from composer.runtime.process.instance_lock import REPORT_KEY_VARIABLE
from composer.runtime.protocol.reports import NodeReport


class KeptGoals:
    """The goals that processes have reported, then those that they are to keep. Thread-safe."""

    def __init__(self, system: System) -> None:
        self._system = system
        self._lock = threading.Lock()
        self._reported: SystemGoals | None = None
        self._current: SystemGoals | None = None
        self._last: tuple[Mapping[str, PrimaryState], str] | None = None

    @property
    def found(self) -> SystemGoals | None:
        """The last goals of an earlier coordinating process that has not shut the system down."""
        reported = self._reported
        return None if reported is None or reported.activity == STOPPED else reported

    def change(self, goals: Mapping[str, PrimaryState], activity: str) -> SystemGoals | None:
        """Set goals by the keys of nodes; return them for all processes if they are new ones."""
        if self._last == (goals, activity):
            return None
        self._last = goals, activity
        return self._replace(system_goals(self._system, goals, activity, serial=0))

    def stop(self) -> SystemGoals | None:
        """Let the next coordinating process start the system as if it were the first one."""
        return None if self._current is None else self._replace(SystemGoals(0, STOPPED))

    def on_report(self, reported: SystemGoals | None) -> SystemGoals | None:
        """Receive what a process keeps; return what it is to keep instead."""
        with self._lock:
            current = self._current
            if current is None:
                if reported is not None and _serial(reported) > _serial(self._reported):
                    self._reported = reported
                return None
            if reported == current:
                return None
            if _serial(reported) >= current.serial:  # found too late to be used
                self._current = current = replace(current, serial=_serial(reported) + 1)
            return current

    def _replace(self, goals: SystemGoals) -> SystemGoals:
        with self._lock:
            serial = max(_serial(self._reported), _serial(self._current)) + 1
            self._current = replace(goals, serial=serial)
            return self._current


def _serial(goals: SystemGoals | None) -> int:
    return -1 if goals is None else goals.serial


class ProcessUnavailable(Exception):
    """The process cannot be started, or has ended; the text is the reason."""


class Member(Protocol):
    """A node of the process. Called on the loop."""

    @property
    def full_name(self) -> str:
        """Its name in reports."""

    @property
    def state(self) -> str:
        """Its lifecycle state, as far as this process knows."""

    def on_report(self, reported: NodeReport) -> None:
        """Receive its state, with each report."""

    def on_process_end(self, reason: str) -> None:
        """Receive that the process has ended or does not report any more."""

    def on_process_return(self) -> None:
        """Receive that the process is there again, without a start from here."""


@dataclass(frozen=True, slots=True)
class MemberContext:
    """What a process of the system needs from the one that coordinates it.

    ``namespace`` is that of the coordinating manager; ``command`` starts ``compose run`` with the
    same system, and is empty if the process is only to be awaited. ``goals`` are those of the whole
    system, which its processes keep. What nodes report within the context manager ``together`` is
    handled together.
    """

    loop: Loop
    manager: RosNode
    children: ChildProcesses
    namespace: str
    command: Sequence[str]
    goals: KeptGoals
    write_log: Callable[[LogLevel, str, str], None]
    together: Callable[[], AbstractContextManager[None]] = nullcontext

    def full_name(self, process: Process) -> str:
        """Return the full name of a process, which is the namespace of its manager."""
        return f"{self.namespace}/{process.name.value}"

    def command_of(self, process: Process, report_key: str) -> Command:
        """Return the command that starts a process, which signs its reports with the key."""
        words = (*self.command, "--process", process.name.value)
        # Its lines are parsed, whatever format those of this process have.
        usual = {"PYTHONUNBUFFERED": "1", "RCUTILS_CONSOLE_OUTPUT_FORMAT": CONSOLE_FORMAT}
        usual |= own_enclave(os.environ, self.full_name(process))
        environment = {name.value: value for name, value in process.environment}
        return Command(words, {**usual, **environment, REPORT_KEY_VARIABLE: report_key})
