"""A class with callbacks that block a shared executor, or that reads from the terminal."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.hosted_classes import ClassOfNode, hosted_classes
from composer.behavior_source import Call
from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.model import ExecutorKind, Node

RULE = register(
    Rule(
        code="RC467",
        name="class-blocks",
        severity=Severity.WARNING,
        summary="A class blocks an executor that other nodes use, or reads from the terminal.",
        why=(
            "While a callback sleeps or waits for a response, its thread runs no other callback. "
            "By default each class has an executor of its own, where it delays nothing else. "
            "Input from the terminal would keep its node waiting, and so the whole bring-up."
        ),
        bad="""\
# file: system.yaml
system: robot
executors: {shared: {kind: single_threaded}}
nodes:
  camera: {class: robot_nodes:Camera, executor: shared}
  lidar: {class: robot_nodes:Lidar, executor: shared}
# file: robot_nodes.py
import time

from rclpy.node import Node


class Camera(Node):
    def __init__(self):
        super().__init__("camera")
        self.create_timer(1.0, self.tick)

    def tick(self):
        time.sleep(0.5)


class Lidar(Node):
    def __init__(self):
        super().__init__("lidar")
""",
        good="""\
# file: system.yaml
system: robot
nodes:
  camera: {class: robot_nodes:Camera}
  lidar: {class: robot_nodes:Lidar}
# file: robot_nodes.py
import time

from rclpy.node import Node


class Camera(Node):
    def __init__(self):
        super().__init__("camera")
        self.create_timer(1.0, self.tick)

    def tick(self):
        time.sleep(0.5)


class Lidar(Node):
    def __init__(self):
        super().__init__("lidar")
""",
    )
)

_ALONE = "leave out 'executor': each class then has an event loop of its own"


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the calls of every class: input always, waiting if the executor does not allow it."""
    kinds = {item.name.value: item.kind for item in context.system.executors}
    for found in context.once(hosted_classes):
        executor = found.node.executor
        others = [
            node
            for node in context.system.nodes
            if executor is not None
            and node is not found.node
            and node.executor is not None
            and node.executor.value == executor.value
        ]
        kind = kinds.get(executor.value) if executor is not None else None
        yield from _of_class(found, kind, others)


def _of_class(
    found: ClassOfNode, kind: ExecutorKind | None, others: list[Node]
) -> Iterator[Diagnostic]:
    name = found.source.reference.class_name
    for method in found.methods:
        for call in method.calls:
            if call.name == "input" and not call.deferred:
                message = f"'{method.name}' of '{name}' reads from the terminal"
                hint = "run the program in a terminal of its own, outside the system"
                yield found.diagnostic(RULE, message, call.span, hint)
            elif others and call.name == "time.sleep" and method.name != "__init__":
                message = f"'{method.name}' of '{name}' sleeps, and node '{others[0].name}' waits"
                yield found.diagnostic(RULE, message, call.span, _ALONE)
            elif kind is ExecutorKind.SINGLE_THREADED and _waits_for_response(call):
                message = (
                    f"'{method.name}' of '{name}' waits for a response that its only thread would"
                    " have to receive"
                )
                yield found.diagnostic(RULE, message, call.span, _ALONE)


def _waits_for_response(call: Call) -> bool:
    """Return whether it looks like ``self.client.call(request)``."""
    return call.name.startswith("self.") and call.name.endswith(".call") and not call.awaited
