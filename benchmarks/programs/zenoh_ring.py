"""The ring of nodes with Zenoh: a publisher and a subscriber per node, in one session."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import zenoh

from benchmarks.programs.task import task_from_arguments, topic
from benchmarks.programs.work import COUNTS, measure, needs_kick, print_result


def main() -> None:
    task = task_from_arguments()
    started_s = time.perf_counter()
    config = zenoh.Config()
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("listen/endpoints", "[]")
    session = zenoh.open(config)
    keys = [topic(index).strip("/") for index in range(task.nodes)]
    publishers = [session.declare_publisher(key) for key in keys]

    def relay(index: int) -> Callable[[Any], None]:
        send = publishers[(index + 1) % task.nodes].put

        def on_input(sample: Any) -> None:
            COUNTS.delivered += 1
            send(sample.payload.to_string())

        return on_input

    subscribers = [session.declare_subscriber(key, relay(index)) for index, key in enumerate(keys)]
    seen = [0]

    def kick() -> None:
        if needs_kick(seen[0]):
            publishers[0].put("x" * 32)
        seen[0] = COUNTS.delivered

    figures = measure(task, started_s, kick)
    del subscribers
    print_result(figures)


if __name__ == "__main__":
    main()
