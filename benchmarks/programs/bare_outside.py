"""The least that a node in Python does to pass a message on to another process.

rcl wakes its thread up, which takes the message and publishes it, by rclpy. There is no executor,
lifecycle, timer, counting, or containment of what callbacks raise. Fast DDS has the profile that
the composer's processes have.
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
from benchmarks.programs.work import COUNTS, hand_over, measure, needs_kick
from composer.runtime.executors.readiness import MESSAGE, Signal
from composer.runtime.process.dds_profiles import use_discovery_profile


def pass_on(subscription: Subscription, publisher: Publisher) -> None:
    """Publish what comes, for ever."""
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
    """Make the node of this process, measure, tell."""
    task = task_from_arguments()
    (place,) = places(task)
    kind = CLASSES[task.message]
    started_s = time.perf_counter()
    use_discovery_profile(os.environ)
    rclpy.init()
    node = rclpy.create_node(f"node_{place.index}")
    publisher = node.create_publisher(kind, place.sends, QUEUE_DEPTH)
    subscription = node.create_subscription(kind, place.hears, lambda _: None, QUEUE_DEPTH)
    threading.Thread(target=pass_on, args=(subscription, publisher), daemon=True).start()
    seen = 0

    def kick() -> None:
        nonlocal seen
        if needs_kick(seen):
            publisher.publish(make(task.message))
        seen = COUNTS.delivered

    hand_over(measure(task, started_s, kick))


if __name__ == "__main__":
    main()
