"""The minimum work for a task in Python: wake up and pass a message from object to object.

The nodes exist, as in the hand-written program, but messages do not use ROS: no lifecycle, QoS,
other processes, counters or exception handling. This is a lower bound for Python code.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from typing import Any

import rclpy

from benchmarks.programs.hand_written import Relay
from benchmarks.programs.payloads import make
from benchmarks.programs.task import Place, Task, places, task_from_arguments
from benchmarks.programs.work import COUNTS, measure, print_result


class Stage:
    """Receive messages and pass them on."""

    __slots__ = ("following", "is_measured", "waiting")

    def __init__(self, following: Stage | None, *, is_measured: bool) -> None:
        self.following = following
        self.is_measured = is_measured
        self.waiting: deque[Any] = deque()

    def on_input(self, message: Any) -> None:
        if self.is_measured:
            COUNTS.took_ns.append(time.monotonic_ns() - COUNTS.sent_ns)
        COUNTS.delivered += 1
        if self.following is not None:
            self.following.waiting.append(message)
            READY.append(self.following)


READY: deque[Stage] = deque()


def spin(first: Stage, task: Task) -> None:
    """Send messages at the rate of the task, forever."""
    due_s = time.monotonic()
    while True:
        due_s += 1.0 / task.rate_hz
        time.sleep(max(0.0, due_s - time.monotonic()))  # the measurement includes waking up
        message = make(task.message)
        COUNTS.sent_ns = time.monotonic_ns()
        first.waiting.append(message)
        READY.append(first)
        while READY:
            stage = READY.popleft()
            stage.on_input(stage.waiting.popleft())


def first_stage(task: Task) -> Stage:
    """Return the stage that receives the messages of the first node of a chain or a hop."""
    following: Stage | None = None
    for place in reversed([place for place in places(task) if is_reached(task, place)]):
        following = Stage(following, is_measured=not place.relays)
    assert following is not None
    return following


def is_reached(task: Task, place: Place) -> bool:
    """Return whether the node receives messages."""
    return place.index == 1 if task.shape == "hop" else place.index > 0


def main() -> None:
    """Create the nodes, measure, and print the result."""
    task = task_from_arguments()
    started_s = time.perf_counter()
    rclpy.init()
    nodes = [Relay(task, place) for place in places(task)]
    for node in nodes:
        node.trigger_configure()
    threading.Thread(target=spin, args=(first_stage(task), task), daemon=True).start()
    print_result(measure(task, started_s))


if __name__ == "__main__":
    main()
