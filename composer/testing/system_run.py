"""Runs a system on a thread of its own, in time that the thread of a test controls."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

from composer.model import System
from composer.plan import bring_up, tear_down
from composer.runtime.clock.clock import Clock
from composer.runtime.clock.virtual import VirtualClock
from composer.runtime.host import Host
from composer.runtime.host_options import HostOptions
from composer.runtime.supervision.events import Outcome, Report
from composer.runtime.supervision.virtual_time import ISOLATION
from composer.testing.declarations import load_file
from composer.testing.failures import TestFailure

#: The limit of the bring-up, in the time of the system.
_UP_WITHIN_S = 60.0
#: The longest time in which a system that ends has to end.
_ENDS_WITHIN_S = 10.0
_POLL_S = 0.001
#: In real time, a system holds a lock for its domain; tests that run side by side have others.
_DOMAINS = 100


class SystemRun:
    """One run, by the clock of ``options``.

    In virtual time, the thread that creates the clock calls all methods, and nothing in the system
    runs until it waits.
    """

    def __init__(self, system: System, options: HostOptions, report: Report) -> None:
        self.clock: Clock = options.clock
        self._start_s = self.clock.monotonic()
        options = replace(options, bring_up_within_s=_UP_WITHIN_S, started_at_s=self._start_s)
        self.host = Host(system, bring_up(system), tear_down(system), options, report)
        #: How the run has ended; None while it lasts.
        self.outcome: Outcome | None = None
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="system", daemon=True)
        self._variables: dict[str, str] = {}

    @property
    def now_s(self) -> float:
        """The seconds since the start of the run."""
        return self.clock.monotonic() - self._start_s

    def start(self, is_up: Callable[[], bool]) -> None:
        """Start the system, and let it run until it is up or has ended.

        Nothing outside of the process takes part in the run. Raises StartRefused if the system
        cannot run here.
        """
        self._variables = dict(os.environ)
        os.environ.update(ISOLATION, ROS_DOMAIN_ID=str(1 + os.getpid() % _DOMAINS))
        self.clock.start(self._thread)
        try:
            self.wait(lambda: is_up() or self.outcome is not None, inf)
        except BaseException:  # such as KeyboardInterrupt
            self.end()
            raise
        if not is_up():
            self.end()

    def wait(self, condition: Callable[[], object], timeout_s: float) -> bool:
        """Let the system run until ``condition()``; return its value. Raises what it raises."""
        errors: list[BaseException] = []

        def is_over() -> bool:
            try:
                return bool(errors) or bool(condition())
            except BaseException as error:  # not on the thread that happens to check it
                errors.append(error)
                return True

        until_s = self.clock.monotonic() + timeout_s
        if isinstance(self.clock, VirtualClock):
            is_true = self.clock.wait_until(is_over, until_s)
        else:
            while not (is_true := is_over()) and self.clock.monotonic() < until_s:
                self.clock.sleep(_POLL_S)
        if errors:
            raise errors[0]
        return is_true

    def end(self) -> None:
        """Shut the system down. Raises what has ended it, TestFailure if it does not end."""
        self.host.stop("end of the test")
        self.clock.join(self._thread, _ENDS_WITHIN_S)
        for name in os.environ.keys() - self._variables.keys():
            del os.environ[name]
        os.environ.update(self._variables)
        if self._error is not None:
            raise self._error
        if self.outcome is None:
            raise TestFailure(f"the system did not end within {_ENDS_WITHIN_S:g} s")

    def _run(self) -> None:
        try:
            self.outcome = self.host.run()
        except BaseException as error:  # raised again on the thread of the test
            self._error = error
            self.outcome = Outcome(1, str(error), self.now_s, ())


def load_system(path: Path, arguments: Mapping[str, Any], settings: Mapping[str, Any]) -> System:
    """Return the model of a file, with values of arguments and of parameters (``node.name``).

    Raises TestFailure with the diagnostics if the file has errors; the rules do not check it.
    """
    return load_file(path, arguments, settings)[0]
