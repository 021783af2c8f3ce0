"""A talker and a listener as ordinary rclpy node classes, which know nothing of the composer."""

from __future__ import annotations

import time
from typing import Any

from rclpy.node import Node

from benchmarks.programs.payloads import CLASSES, make
from benchmarks.programs.task import Task, topic
from benchmarks.programs.work import COUNTS

QUEUE_DEPTH = 10
#: Set before the nodes are created.
TASKS: list[Task] = []


class Talker(Node):
    """Publishes at a fixed rate."""

    def __init__(self) -> None:
        super().__init__("talker")
        self.message = TASKS[0].message
        self.output = self.create_publisher(CLASSES[self.message], topic(1), QUEUE_DEPTH)
        self.create_timer(1.0 / TASKS[0].rate_hz, self.on_tick)

    def on_tick(self) -> None:
        message = make(self.message)
        COUNTS.sent_ns = time.monotonic_ns()
        self.output.publish(message)


class Listener(Node):
    """Receives messages and records their latency."""

    def __init__(self) -> None:
        super().__init__("listener")
        kind = CLASSES[TASKS[0].message]
        self.create_subscription(kind, topic(1), self.on_message, QUEUE_DEPTH)

    def on_message(self, _: Any) -> None:
        COUNTS.took_ns.append(time.monotonic_ns() - COUNTS.sent_ns)
        COUNTS.delivered += 1
