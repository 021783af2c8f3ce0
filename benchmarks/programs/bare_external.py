"""The minimum work to forward a message to another process in Python.

rcl wakes up a thread that takes the message and publishes it with rclpy, without executor,
lifecycle, timers, counters or exception handling. Fast DDS uses the profile of the composer.
"""

from __future__ import annotations

import os
import threading
import time

import rclpy
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription

from benchmarks.programs.hand_written import QUEUE_DEPTH
from benchmarks.programs.payloads import CLASSES, make
from benchmarks.programs.task import places, task_from_arguments
from benchmarks.programs.work import COUNTS, measure, needs_kick, print_result
from composer.runtime.executors.readiness import MESSAGE, Signal
from composer.runtime.middleware.environment import use_discovery_profile


def pass_on(subscription: Subscription, publisher: Publisher) -> None:
    """Forward messages, forever."""
    signal = Signal()
    os.set_blocking(signal.fd, True)
    signal.attach(subscription.handle, MESSAGE)
    while True:
        for _ in range(signal.count()):
            taken = subscription.handle.take_message(subscription.msg_type, False)
            if taken is not None:
                COUNTS.delivered += 1
                publisher.publish(taken[0])


def main() -> None:
    """Create the node of this process, measure, and print the result."""
    task = task_from_arguments()
    (place,) = places(task)
    kind = CLASSES[task.message]
    started_s = time.perf_counter()
    use_discovery_profile(os.environ)
    rclpy.init()
    node = rclpy.create_node(f"node_{place.index}")
    publisher = node.create_publisher(kind, place.output_topic, QUEUE_DEPTH)
    subscription = node.create_subscription(kind, place.input_topic, lambda _: None, QUEUE_DEPTH)
    threading.Thread(target=pass_on, args=(subscription, publisher), daemon=True).start()
    seen = 0

    def kick() -> None:
        nonlocal seen
        if needs_kick(seen):
            publisher.publish(make(task.message))
        seen = COUNTS.delivered

    print_result(measure(task, started_s, kick))


if __name__ == "__main__":
    main()
