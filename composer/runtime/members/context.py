"""What a process of the system needs from the coordinating one."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext

from rclpy.node import Node as RosNode

from composer.base.fast_dataclass import dataclass
from composer.model import LogLevel, Process
from composer.model.hosts import own_enclave
from composer.runtime.children.child_processes import ChildProcesses, Command
from composer.runtime.executors.loop import Loop
from composer.runtime.middleware.environment import CONSOLE_FORMAT
from composer.runtime.process.instance_lock import REPORT_KEY_VARIABLE


class ProcessUnavailable(Exception):
    """The process cannot be started, or has ended; the text is the reason."""


@dataclass(frozen=True, slots=True)
class MemberContext:
    """What a process of the system needs from the one that coordinates it.

    ``namespace`` is that of the coordinating manager; ``command`` starts ``compose run`` with the
    same system, and is empty if the process is only to be awaited. What nodes report within the
    context manager ``together`` is handled together.
    """

    loop: Loop
    manager: RosNode
    children: ChildProcesses
    namespace: str
    command: Sequence[str]
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
