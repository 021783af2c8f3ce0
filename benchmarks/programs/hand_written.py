"""The same system written by hand: default rclpy lifecycle nodes on one of rclpy's executors."""

from __future__ import annotations

import threading
import time

import rclpy
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from std_msgs.msg import String

from benchmarks.programs.work import (
    COUNTS,
    PAYLOAD,
    Task,
    hand_over,
    measure,
    needs_kick,
    task_from_arguments,
    topic,
)

THREADS = 2
QUEUE_DEPTH = 10

EXECUTORS = {
    "SingleThreadedExecutor": SingleThreadedExecutor,
    "MultiThreadedExecutor": lambda: MultiThreadedExecutor(num_threads=THREADS),
    "EventsExecutor": EventsExecutor,
}


class Relay(LifecycleNode):
    """Passes messages on."""

    def __init__(self, task: Task, index: int) -> None:
        super().__init__(f"relay_{index}")
        self.task = task
        self.index = index
        self.seen = 0

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        nodes = self.task.nodes
        self.output = self.create_lifecycle_publisher(
            String, topic(self.index + 1, nodes), QUEUE_DEPTH
        )
        self.create_subscription(String, topic(self.index, nodes), self.on_input, QUEUE_DEPTH)
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        if self.index == 0 and self.task.timer_hz is not None:
            self.create_timer(1.0 / self.task.timer_hz, self.on_tick)
        return super().on_activate(state)

    def on_input(self, message: String) -> None:
        COUNTS.delivered += 1
        self.output.publish(message)

    def kick(self) -> None:
        if self.task.timer_hz is None and needs_kick(self.seen):
            self.output.publish(String(data=PAYLOAD))
        self.seen = COUNTS.delivered

    def on_tick(self) -> None:
        COUNTS.ticks_ns.append(time.monotonic_ns())


def main() -> None:
    """Bring the system up, measure, tell."""
    task = task_from_arguments()
    started_s = time.perf_counter()
    rclpy.init()
    nodes = [Relay(task, index) for index in range(task.nodes)]
    for node in nodes:
        node.trigger_configure()
    for node in reversed(nodes):
        node.trigger_activate()
    executor = EXECUTORS[task.executor]()
    for node in nodes:
        executor.add_node(node)
    threading.Thread(target=executor.spin, daemon=True).start()
    # From here and not by a timer: EventsExecutor's did not always run, which is its own matter.
    hand_over(measure(task, started_s, nodes[0].kick))


if __name__ == "__main__":
    main()
