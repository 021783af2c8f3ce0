"""What a test sees of a system: its messages, its log, its events, in one timeline."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from composer.base.fast_dataclass import dataclass
from composer.behavior import GoalRejected
from composer.model.names import PROGRAM_LOGGER
from composer.runtime.executors.futures import Future
from composer.runtime.ros.messages import to_plain
from composer.runtime.supervision.events import BroughtUp, Event, Logged
from composer.testing.failures import LogLine, Received, Timeline, short
from composer.testing.tester import TESTER


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
