"""The goals of a system, kept in a file for the next coordinating process on this computer.

They count only if other processes have kept nodes of the system, which they do not move by
themselves: a paused system stays paused. The module needs no ROS.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from composer.base.fast_dataclass import dataclass
from composer.base.files import write_whole
from composer.model import PrimaryState, System
from composer.runtime.protocol.codec import decode, encode


@dataclass(frozen=True, slots=True)
class SystemGoals:
    """The goals of nodes by their full names. ``activity`` is what the system does: "paused"."""

    activity: str
    goals: Mapping[str, PrimaryState]


class KeptGoals:
    """The file with the goals of one system. Without a folder for it, nothing is kept."""

    def __init__(self, system: System, path: Path | None) -> None:
        self._path = path
        self._names = {node.name.value: node.full_name for node in system.nodes}
        self._last: SystemGoals | None = None

    def keep(self, goals: Mapping[str, PrimaryState], activity: str) -> None:
        """Keep goals by the keys of nodes, if they are new ones."""
        if self._path is None:
            return
        new = SystemGoals(activity, {self._names[name]: goal for name, goal in goals.items()})
        if new != self._last:
            self._last = new
            with suppress(OSError):
                write_whole(self._path, encode(new))

    def read(self) -> tuple[Mapping[str, PrimaryState], str] | None:
        """Return the goals by the keys of nodes, and the activity; None if no file has them."""
        if self._path is None:
            return None
        try:
            kept = decode(self._path.read_text(encoding="utf-8"), SystemGoals)
        except (OSError, ValueError):
            return None
        goals = {
            name: kept.goals[full_name]
            for name, full_name in self._names.items()
            if full_name in kept.goals
        }
        return goals, kept.activity

    def forget(self) -> None:
        """Let the next coordinating process start the system as if it were the first one."""
        if self._path is not None:
            with suppress(OSError):
                self._path.unlink()
