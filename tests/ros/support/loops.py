"""Support for tests of loops: a loop of each kind with a node, and a second process."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any

import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node

from composer.model import ExecutorKind
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.sources import Taken
from composer.runtime.executors.tasks import Report
from tests.ros.support.forked import ForkedProgram
from tests.ros.support.service_calls import leave

PEER = Path(__file__).parents[1] / "programs" / "loop_peer.py"
PATIENCE_S = 60.0
#: One mechanism serves all three kinds; ``single_threaded`` differs only if a callback blocks.
KINDS = [ExecutorKind.EVENTS, ExecutorKind.MULTI_THREADED]


@dataclass
class Bench:
    """A running loop, its node, and the reported exceptions."""

    loop: Loop
    node: Node
    reports: list[tuple[str, BaseException]]

    def errors(self) -> list[type[BaseException]]:
        return [type(error) for _, error in self.reports]

    def group(self) -> ReentrantCallbackGroup:
        return ReentrantCallbackGroup()

    def subscribe(self, kind: Any, topic: str, callback: Callable[[Any], None], **qos: Any) -> Any:
        profile = rclpy.qos.QoSProfile(**{"depth": 10, **qos})
        subscription = self.node.create_subscription(kind, topic, callback, profile)

        @wraps(callback)
        def call(taken: Taken) -> None:
            callback(taken[0])

        self.loop.add_subscription(subscription, call)
        return subscription

    def serve(self, kind: Any, name: str, callback: Callable[[Any, Any], None]) -> Any:
        service = self.node.create_service(kind, name, lambda _, response: response)
        self.loop.add_service(service, callback)
        return service

    def client(self, kind: Any, name: str) -> Any:
        client = self.node.create_client(kind, name)
        self.loop.add_client(client)
        return client


def print_error(what: str, error: BaseException) -> None:
    print(f"{what}: {error!r}")


def loop_of(kind: ExecutorKind, on_exception: Report = print_error) -> Loop:
    return Loop("default", on_exception, kind, threads=3)


@contextmanager
def bench(kind: ExecutorKind, name: str = "bench") -> Iterator[Bench]:
    """Run a loop with a node for the length of the block."""
    rclpy.init()
    try:
        reports: list[tuple[str, BaseException]] = []
        loop = loop_of(kind, lambda *report: reports.append(report))
        node = Node(name, enable_logger_service=True)
        loop.add_node(node)
        loop.start()
        try:
            yield Bench(loop, node, reports)
        finally:
            loop.remove_node(node)
            stopped = loop.stop(60.0)
            leave(node)
        assert stopped, "the loop did not stop"
    finally:
        rclpy.shutdown()


@contextmanager
def peer(*arguments: object) -> Iterator[ForkedProgram]:
    """Run ``loop_peer.py``, hand-written rclpy, in another process."""
    process = ForkedProgram(PEER, *map(str, arguments))
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def wait_for_line(process: ForkedProgram, wanted: str) -> None:
    """Wait until a peer prints a line; Fast DDS may print others."""
    assert any(line.strip() == wanted for line in process.stdout), f"never printed: {wanted}"


def last_line(process: ForkedProgram) -> str:
    """Wait until a peer has ended and return its last line."""
    output, _ = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0, output
    return output.strip().splitlines()[-1]
