"""The goals of the system, as its other processes keep them for the next coordinating one.

It is apart from what needs ROS, so that it is tested without.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import replace

from composer.model import PrimaryState, System
from composer.plan import STOPPED, SystemGoals, system_goals


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
