"""The nodes of the composed systems, as anybody would write them."""

from __future__ import annotations

import time
from typing import Any

from composer_interfaces.action import Navigate
from std_srvs.srv import Trigger

from benchmarks.programs.payloads import make
from benchmarks.programs.task import Task
from benchmarks.programs.work import COUNTS, needs_kick
from composer.behavior import Behavior

#: Set before the system comes up.
TASKS: list[Task] = []


class Relay(Behavior):
    """Passes messages on."""

    def on_input(self, message: Any) -> None:
        """Count the message and pass it on."""
        COUNTS.delivered += 1
        self.publishers.output.publish(message)


class Listener(Behavior):
    """Hears messages."""

    def on_input(self, message: Any) -> None:
        """Count the message."""
        COUNTS.delivered += 1


class Meter(Behavior):
    """Hears messages and how long they took."""

    def on_input(self, message: Any) -> None:
        """Note how long it took."""
        COUNTS.took_ns.append(time.monotonic_ns() - COUNTS.sent_ns)
        COUNTS.delivered += 1


class Starter(Relay):
    """The relay that sets the message going."""

    def on_activate(self) -> None:
        """Nothing moves yet."""
        self.seen = 0

    def on_kick(self) -> None:
        """Send a message when none is on its way."""
        if needs_kick(self.seen):
            self.publishers.output.publish(make(TASKS[0].message))
        self.seen = COUNTS.delivered


class Source(Behavior):
    """Sends at a rate."""

    def on_tick(self) -> None:
        """Send a new message."""
        message = make(TASKS[0].message)
        COUNTS.sent_ns = time.monotonic_ns()
        self.publishers.output.publish(message)


class Ticker(Relay):
    """Notes when its timer is called."""

    def on_tick(self) -> None:
        """Note the time."""
        COUNTS.ticks_ns.append(time.monotonic_ns())


class Asker(Relay):
    """Calls a service, again and again."""

    async def on_kick(self) -> None:
        """Never come back: the timer leaves out what is due meanwhile."""
        while True:
            began_ns = time.monotonic_ns()
            await self.clients.ask.call(Trigger.Request())
            COUNTS.took_ns.append(time.monotonic_ns() - began_ns)
            COUNTS.delivered += 1


class Answerer(Relay):
    """Answers."""

    def on_ask(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Answer at once."""
        response.success = True
        return response


class Sender(Relay):
    """Sends goals, again and again."""

    async def on_kick(self) -> None:
        """Never come back."""
        while True:
            began_ns = time.monotonic_ns()
            goal = await self.action_clients.go.send_goal(Navigate.Goal())
            await goal.result()
            COUNTS.took_ns.append(time.monotonic_ns() - began_ns)
            COUNTS.delivered += 1


class Worker(Relay):
    """Reaches goals."""

    def on_go(self, goal: Any) -> Navigate.Result:
        """Be there at once."""
        return Navigate.Result()
