"""A simulator that only publishes /clock."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from builtin_interfaces.msg import Time
from rosgraph_msgs.msg import Clock

from tests.ros.support.in_process import Peer, RunningSystem, wait_until

NANOSECONDS = 10**9


def message_of(time_s: float) -> Clock:
    nanoseconds = round(time_s * NANOSECONDS)
    return Clock(clock=Time(sec=nanoseconds // NANOSECONDS, nanosec=nanoseconds % NANOSECONDS))


class Simulator:
    """Publishes times and waits until the nodes of a system have them."""

    def __init__(self, peer: Peer, system: RunningSystem) -> None:
        self._system = system
        self._publisher = peer.publisher(Clock, "/clock")

    def set_time(self, *times_s: float, node: str = "a") -> None:
        """Publish each time until it is received, since a message may be lost."""
        for time_s in times_s:
            self._publisher.publish(message_of(time_s))
            wait_until(lambda time_s=time_s: self._is(node, time_s), f"{time_s} at {node}")

    def set_invalid_time(self) -> None:
        """Publish a time before 1970."""
        self._publisher.publish(Clock(clock=Time(sec=-1)))

    def _is(self, node: str, time_s: float) -> bool:
        if self._system.node(node).now_s() == time_s:
            return True
        self._publisher.publish(message_of(time_s))
        return False

    @contextmanager
    def runs(self, start_s: float, factor: float) -> Iterator[Callable[[], float]]:
        """Publish the time ``factor`` times as fast as real time; yield how to read it."""
        began_s, over = time.monotonic(), threading.Event()
        now_s = start_s

        def run() -> None:
            nonlocal now_s
            while not over.wait(0.005):
                now_s = start_s + factor * (time.monotonic() - began_s)
                self._publisher.publish(message_of(now_s))

        thread = threading.Thread(target=run, daemon=True)
        thread.start()
        try:
            yield lambda: now_s
        finally:
            over.set()
            thread.join()


def listeners(peer: Peer) -> list[Any]:
    """Return the subscriptions of /clock."""
    return list(peer.node.get_subscriptions_info_by_topic("/clock"))
