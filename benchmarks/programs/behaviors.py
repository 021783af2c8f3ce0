"""The behaviors of the composed systems."""

from __future__ import annotations

import time
from typing import Any

from composer_interfaces.action import Navigate
from nav_msgs.msg import Odometry
from std_srvs.srv import Trigger

from benchmarks.programs.payloads import make
from benchmarks.programs.task import Task
from benchmarks.programs.work import COUNTS, needs_kick
from composer.behavior import Behavior

#: Set before the system comes up.
TASKS: list[Task] = []


class Relay(Behavior):
    """Forwards messages."""

    def on_input(self, message: Any) -> None:
        """Count the message and forward it."""
        COUNTS.delivered += 1
        self.publishers.output.publish(message)


class Listener(Behavior):
    """Receives messages."""

    def on_input(self, message: Any) -> None:
        """Count the message."""
        COUNTS.delivered += 1


class Meter(Behavior):
    """Receives messages and records their latency."""

    def on_input(self, message: Any) -> None:
        """Record the latency."""
        COUNTS.took_ns.append(time.monotonic_ns() - COUNTS.sent_ns)
        COUNTS.delivered += 1


class Starter(Relay):
    """The relay that publishes the first message."""

    def on_activate(self) -> None:
        """Reset the counter."""
        self.seen = 0

    def on_kick(self) -> None:
        """Publish a message if none is in flight."""
        if needs_kick(self.seen):
            self.publishers.output.publish(make(TASKS[0].message))
        self.seen = COUNTS.delivered


class Source(Behavior):
    """Publishes at a fixed rate."""

    def on_tick(self) -> None:
        """Publish a new message."""
        message = make(TASKS[0].message)
        COUNTS.sent_ns = time.monotonic_ns()
        self.publishers.output.publish(message)


class Ticker(Relay):
    """Records the calls of its timer."""

    def on_tick(self) -> None:
        """Record the time."""
        COUNTS.ticks_ns.append(time.monotonic_ns())


class Caller(Relay):
    """Calls a service repeatedly."""

    async def on_kick(self) -> None:
        """Call forever; the timer skips its next calls."""
        while True:
            began_ns = time.monotonic_ns()
            await self.clients.trigger.call(Trigger.Request())
            COUNTS.took_ns.append(time.monotonic_ns() - began_ns)
            COUNTS.delivered += 1


class Responder(Relay):
    """Provides the service."""

    def on_trigger(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Respond immediately."""
        response.success = True
        return response


class Sender(Relay):
    """Sends goals repeatedly."""

    async def on_kick(self) -> None:
        """Send goals forever."""
        while True:
            began_ns = time.monotonic_ns()
            goal = await self.action_clients.go.send_goal(Navigate.Goal())
            await goal.result()
            COUNTS.took_ns.append(time.monotonic_ns() - began_ns)
            COUNTS.delivered += 1


class Worker(Relay):
    """Executes goals."""

    def on_go(self, goal: Any) -> Navigate.Result:
        """Succeed immediately."""
        return Navigate.Result()


class DurationSource(Behavior):
    """Publishes odometry, and keeps how long each call has taken, in microseconds."""

    durations_us: list[float] = []  # noqa: RUF012 - of the one instance

    def on_tick(self) -> None:
        begin_ns = time.perf_counter_ns()
        self.publishers["odometry"].publish(Odometry())
        self.durations_us.append((time.perf_counter_ns() - begin_ns) / 1000)
