"""Runs a system on a thread of its own, in time that a test controls, and notes what it reports."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import inf
from typing import Any

from composer.base.fast_dataclass import dataclass
from composer.behavior import GoalRejected
from composer.model import System
from composer.model.names import PROGRAM_LOGGER
from composer.plan import bring_up, tear_down
from composer.runtime.clock import Clock, VirtualClock
from composer.runtime.executors.futures import Future
from composer.runtime.host import Host
from composer.runtime.host_options import HostOptions
from composer.runtime.ros.messages import to_plain
from composer.runtime.supervision.events import BroughtUp, Event, Logged, Outcome, Report
from composer.runtime.supervision.virtual_time import ISOLATION
from composer.testing.failures import LogLine, Received, TestFailure, Timeline, short
from composer.testing.tester import TESTER

#: The limit of the bring-up, in the time of the system.
_UP_WITHIN_S = 60.0
#: The longest time in which a system that ends has to end.
_ENDS_WITHIN_S = 10.0
_POLL_S = 0.001
#: In real time, a system holds a lock for its domain; tests that run side by side have others.
_DOMAINS = 100


@dataclass(frozen=True, slots=True)
class Answer:
    """The response of a service, or the result of an action, to what the test has sent.

    ``status`` is "succeeded", or what went wrong; ``message`` is None if there is no answer.
    """

    time_s: float
    name: str
    status: str
    message: Any


class Observation:
    """Everything that a run has reported so far."""

    def __init__(self, now_s: Callable[[], float]) -> None:
        """``now_s`` returns the seconds since the start of the run."""
        self._now_s = now_s
        self.messages: dict[str, list[Received]] = {}
        self.log: list[LogLine] = []
        self.events: list[Event] = []
        #: All of these, in the order in which they were reported.
        self.history: list[Received | Answer | LogLine | Event] = []
        self.timeline = Timeline()
        #: Whether the bring-up is over.
        self.is_up = False

    def on_message(self, topic: str, message: Any) -> None:
        """Receive a message of a topic."""
        received = Received(self._now_s(), message, topic)
        self.messages.setdefault(topic, []).append(received)
        self.history.append(received)
        self.timeline.add(received.time_s, lambda: f"{topic}: {short(to_plain(message))}", topic)

    def on_event(self, event: Event) -> None:
        """Receive an event of the host. Those of the test's own node are left out."""
        names = (getattr(event, "node", ""), getattr(event, "logger", ""))
        if TESTER in names or f"/{TESTER}" in names:
            return
        if isinstance(event, Logged):
            node = "" if event.logger == PROGRAM_LOGGER else f"/{event.logger.replace('.', '/')}"
            line = LogLine(event.elapsed_s, event.level, node, event.message)
            self.log.append(line)
            self.history.append(line)
        else:
            if isinstance(event, BroughtUp):
                event = replace(event, active=event.active - 1, nodes=event.nodes - 1)
                self.is_up = True
            self.events.append(event)
            self.history.append(event)
        self.timeline.add(event.elapsed_s, partial(_text, event))

    def on_response(self, service: str, response: Future[Any]) -> None:
        """Receive the response to a request of the test."""
        error = _error(response)
        self._answer(service, error or "responded", None if error else response.result())

    def on_goal_answered(self, action: str, sent: Future[Any]) -> None:
        """Receive whether a goal of the test was accepted, and follow it to its result."""
        if isinstance(sent.exception(), GoalRejected):
            self._answer(action, "rejected", None)
        elif error := _error(sent):
            self._answer(action, error, None)
        else:
            sent.result().result().add_done_callback(partial(self._on_result, action))

    def on_published(self, message: Any, topic: str) -> None:
        """Note a message of the test. Of many on a topic, the timeline shows the last few."""
        self.timeline.add(
            self._now_s(),
            lambda: f"test: published {short(to_plain(message))} on {topic}",
            f"published on {topic}",
        )

    def on_action(self, text: str) -> None:
        """Note what the test does."""
        self.timeline.add(self._now_s(), lambda: f"test: {text}")

    def _on_result(self, action: str, outcome: Future[Any]) -> None:
        error = _error(outcome)
        status = error or outcome.result().status
        self._answer(action, status, None if error else outcome.result().result)

    def _answer(self, name: str, status: str, message: Any) -> None:
        answer = Answer(self._now_s(), name, status, message)
        self.history.append(answer)
        content = "" if message is None else f": {short(to_plain(message))}"
        self.timeline.add(answer.time_s, lambda: f"{name} {status}{content}")


def _error(future: Future[Any]) -> str:
    """Return why a call has failed; empty if it has not."""
    error = future.exception()
    return "was canceled" if future.cancelled() else "" if error is None else f"failed: {error}"


def _text(event: Event) -> str:
    if isinstance(event, Logged):
        return f"[{event.level.upper()}] [{event.logger}] {event.message}"
    return str(event)


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
