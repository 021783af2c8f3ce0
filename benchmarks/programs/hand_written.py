"""The hand-written system: default rclpy lifecycle nodes on an executor of rclpy."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

import rclpy
from composer_interfaces.action import Navigate
from rclpy.action import ActionClient, ActionServer
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from std_srvs.srv import Trigger

from benchmarks.programs import node_classes
from benchmarks.programs.payloads import CLASSES, make
from benchmarks.programs.task import Place, Task, places, task_from_arguments
from benchmarks.programs.work import COUNTS, measure, needs_kick, print_result

THREADS = 2
QUEUE_DEPTH = 10

EXECUTORS = {
    "SingleThreadedExecutor": SingleThreadedExecutor,
    "MultiThreadedExecutor": lambda: MultiThreadedExecutor(num_threads=THREADS),
    "EventsExecutor": EventsExecutor,
}


class Relay(LifecycleNode):
    """Receives and forwards messages, depending on its place."""

    def __init__(self, task: Task, place: Place) -> None:
        super().__init__(f"node_{place.index}")
        self.task = task
        self.place = place
        self.seen = 0

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        kind = CLASSES[self.task.message]
        if self.place.output_topic is not None:
            self.output = self.create_lifecycle_publisher(
                kind, self.place.output_topic, QUEUE_DEPTH
            )
        if self.place.input_topic is not None and not self.is_source:
            self.create_subscription(kind, self.place.input_topic, self.callback(), QUEUE_DEPTH)
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        if self.place.index == 0 and self.task.is_timed:
            tick = self.on_tick if self.task.shape == "timer" else self.send
            self.create_timer(1.0 / self.task.rate_hz, tick)
        return super().on_activate(state)

    @property
    def is_source(self) -> bool:
        return self.place.index == 0 and self.task.shape in ("chain", "star", "hop")

    def callback(self) -> Callable[[Any], None]:
        if not self.place.relays:
            return self.on_measured_input
        return self.on_last_input if self.place.output_topic is None else self.on_input

    def on_input(self, message: Any) -> None:
        COUNTS.delivered += 1
        self.output.publish(message)

    def on_last_input(self, message: Any) -> None:
        COUNTS.delivered += 1

    def on_measured_input(self, message: Any) -> None:
        COUNTS.took_ns.append(time.monotonic_ns() - COUNTS.sent_ns)
        COUNTS.delivered += 1

    def send(self) -> None:
        message = make(self.task.message)
        COUNTS.sent_ns = time.monotonic_ns()
        self.output.publish(message)

    def kick(self) -> None:
        if self.task.shape == "ring" and needs_kick(self.seen):
            self.send()
        self.seen = COUNTS.delivered

    def on_tick(self) -> None:
        COUNTS.ticks_ns.append(time.monotonic_ns())


class Caller(Relay):
    """Calls a service repeatedly."""

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        self.client = self.create_client(Trigger, "/trigger")
        self.is_pending = False
        return super().on_configure(state)

    def kick(self) -> None:
        if not self.is_pending and self.client.service_is_ready():
            self.is_pending = True
            self.call()

    def call(self) -> None:
        self.began_ns = time.monotonic_ns()
        self.client.call_async(Trigger.Request()).add_done_callback(self.on_response)

    def on_response(self, response: Any) -> None:
        COUNTS.took_ns.append(time.monotonic_ns() - self.began_ns)
        COUNTS.delivered += 1
        self.call()


class Responder(Relay):
    """Provides the service."""

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        self.create_service(Trigger, "/trigger", self.on_trigger)
        return super().on_configure(state)

    def on_trigger(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = True
        return response


class Sender(Relay):
    """Sends goals repeatedly."""

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        self.client = ActionClient(self, Navigate, "/go")
        self.is_pending = False
        return super().on_configure(state)

    def kick(self) -> None:
        if not self.is_pending and self.client.server_is_ready():
            self.is_pending = True
            self.go()

    def go(self) -> None:
        self.began_ns = time.monotonic_ns()
        self.client.send_goal_async(Navigate.Goal()).add_done_callback(self.on_accepted)

    def on_accepted(self, sending: Any) -> None:
        sending.result().get_result_async().add_done_callback(self.on_result)

    def on_result(self, result: Any) -> None:
        COUNTS.took_ns.append(time.monotonic_ns() - self.began_ns)
        COUNTS.delivered += 1
        self.go()


class Worker(Relay):
    """Executes goals."""

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        self.server = ActionServer(self, Navigate, "/go", self.on_go)
        return super().on_configure(state)

    def on_go(self, goal: Any) -> Navigate.Result:
        goal.succeed()
        return Navigate.Result()


PARTS = {
    ("service", 0): Caller,
    ("service", 1): Responder,
    ("action", 0): Sender,
    ("action", 1): Worker,
}


def make_lifecycle_nodes(task: Task) -> list[Any]:
    """Return the nodes of a task, active."""
    nodes = [PARTS.get((task.shape, place.index), Relay)(task, place) for place in places(task)]
    for node in nodes:
        node.trigger_configure()
    for node in reversed(nodes):
        node.trigger_activate()
    return nodes


def make_pair(task: Task) -> list[Any]:
    """Return the talker and the listener."""
    node_classes.TASKS.append(task)
    return [node_classes.Talker(), node_classes.Listener()]


def spin(executor: Any, task: Task) -> None:
    """Spin. EventsExecutor.spin() does not wake up for timers and external messages."""
    can_spin = task.shape == "ring" and task.part is None
    if task.executor == "EventsExecutor" and not can_spin:
        while True:
            executor.spin_once(timeout_sec=1.0)
    executor.spin()


def main() -> None:
    """Bring the system up, measure, and print the result."""
    task = task_from_arguments()
    started_s = time.perf_counter()
    rclpy.init()
    nodes = make_pair(task) if task.shape == "pair" else make_lifecycle_nodes(task)
    executor = EXECUTORS[task.executor]()
    for node in nodes:
        executor.add_node(node)
    threading.Thread(target=spin, args=(executor, task), daemon=True).start()
    print_result(measure(task, started_s, getattr(nodes[0], "kick", lambda: None)))


if __name__ == "__main__":
    main()
