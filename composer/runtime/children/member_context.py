"""What a process of the system needs from the one that coordinates it, and the nodes in it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from rclpy.node import Node as RosNode

from composer.model import LogLevel
from composer.runtime.children.child_processes import ChildProcesses
from composer.runtime.children.kept_goals import KeptGoals
from composer.runtime.children.member_report import MemberState
from composer.runtime.executors.loop import Loop


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

    def on_report(self, reported: MemberState) -> None:
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
    system, which its processes keep.
    """

    loop: Loop
    manager: RosNode
    children: ChildProcesses
    namespace: str
    command: Sequence[str]
    goals: KeptGoals
    write_log: Callable[[LogLevel, str, str], None]
