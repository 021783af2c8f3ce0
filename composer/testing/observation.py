"""What a test sees of a system: its messages, its log, its events, in one timeline."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from composer.model.names import PROGRAM_LOGGER
from composer.runtime.ros.messages import to_plain
from composer.runtime.supervision.events import BroughtUp, Event, Logged
from composer.testing.failures import LogLine, Received, Timeline, short
from composer.testing.tester import TESTER


class Observation:
    """Everything that a run has reported so far."""

    def __init__(self, now_s: Callable[[], float]) -> None:
        """``now_s`` returns the seconds since the start of the run."""
        self._now_s = now_s
        self.messages: dict[str, list[Received]] = {}
        self.log: list[LogLine] = []
        self.events: list[Event] = []
        self.timeline = Timeline()
        #: Whether the bring-up is over.
        self.is_up = False

    def on_message(self, topic: str, message: Any) -> None:
        """Receive a message of a topic."""
        received = Received(self._now_s(), message)
        self.messages.setdefault(topic, []).append(received)
        self.timeline.add(received.time_s, lambda: f"{topic}: {short(to_plain(message))}")

    def on_event(self, event: Event) -> None:
        """Receive an event of the host. Those of the test's own node are left out."""
        names = (getattr(event, "node", ""), getattr(event, "logger", ""))
        if TESTER in names or f"/{TESTER}" in names:
            return
        if isinstance(event, Logged):
            node = "" if event.logger == PROGRAM_LOGGER else f"/{event.logger.replace('.', '/')}"
            self.log.append(LogLine(event.elapsed_s, event.level, node, event.message))
        else:
            if isinstance(event, BroughtUp):
                event = replace(event, active=event.active - 1, nodes=event.nodes - 1)
                self.is_up = True
            self.events.append(event)
        self.timeline.add(event.elapsed_s, partial(_text, event))

    def on_action(self, text: str) -> None:
        """Note what the test does."""
        self.timeline.add(self._now_s(), lambda: f"test: {text}")


def _text(event: Event) -> str:
    if isinstance(event, Logged):
        return f"[{event.level.upper()}] [{event.logger}] {event.message}"
    return str(event)
