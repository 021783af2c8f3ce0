"""What the tests of running systems share: a system in this process, and a hand-written peer."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from pathlib import Path
from textwrap import dedent
from typing import Any, TypeVar

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.srv import SetParameters
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile

from composer.diagnostics import has_errors
from composer.document import parse_bytes
from composer.expand import expand
from composer.model import PrimaryState, System
from composer.node_types import NodeTypes
from composer.plan import bring_up, tear_down
from composer.resolve import resolve
from composer.runtime.host import Host, HostOptions
from composer.runtime.node.node import RunningNode
from composer.runtime.process.shared_memory import remove_incomplete_ports
from composer.runtime.supervision.events import (
    BroughtUp,
    Event,
    Logged,
    NodeSummary,
    Outcome,
    StateChanged,
)
from tests.ros.support.leaving import leave

PATIENCE_S = 20.0
_ENDS_WITHIN_S = 6.0
_GOALS = {
    "configure": "inactive",
    "activate": "active",
    "deactivate": "inactive",
    "cleanup": "unconfigured",
}
E = TypeVar("E", bound=Event)


def wait_until(condition: Callable[[], object], what: str = "") -> None:
    """Wait until ``condition()`` is true. Fails when it does not come true."""
    until_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < until_s, f"did not come true: {what or condition}"
        time.sleep(0.002)


def end_limit_s() -> float:
    """Return how long the end of a system may take: 2 s with a core for each who wants to run.

    Where more want to, everything takes so much longer.
    """
    return 2.0 * max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))


def system_of(text: str, folder: Path, **modules: str) -> System:
    """Return the system that ``text`` declares; ``modules`` become Python files beside it.

    Nothing is checked: what must not end the process includes what the checks would refuse.
    """
    for name, content in modules.items():
        folder.joinpath(f"{name}.py").write_text(dedent(content), encoding="utf-8")
    tree, source, found = parse_bytes(dedent(text).encode(), "system.yaml")
    assert tree is not None, found
    expanded, findings = expand(tree, {})
    node_types = NodeTypes.for_file(folder / "system.yaml")
    system, more = resolve(expanded, source, node_types, folders={source.path: folder})
    findings = [*found, *findings, *more]
    assert system is not None, findings
    assert not has_errors(findings), findings
    return system


class RunningSystem:
    """A host on a thread of this process, and what it told."""

    def __init__(
        self, system: System, options: HostOptions, autostart: PrimaryState | None
    ) -> None:
        self.events: list[Event] = []
        up = bring_up(system, autostart)
        self.host = Host(system, up, tear_down(system), options, self.events.append)
        self._outcome: Future[Outcome] = Future()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        try:
            self._outcome.set_result(self.host.run())
        except BaseException as error:
            self._outcome.set_exception(error)

    def reported(self, kind: type[E]) -> list[E]:
        return [event for event in tuple(self.events) if isinstance(event, kind)]

    def states(self, node: str | None = None) -> list[str]:
        """Where nodes came to rest, in order: ``/talker active``."""
        changes = [str(event) for event in self.reported(StateChanged)]
        return changes if node is None else [text for text in changes if text.startswith(node)]

    def node(self, name: str) -> RunningNode:
        """Return the node of that name in the system, whatever state it is in."""
        return self.host._node_set.nodes[name]

    def behavior(self, name: str) -> Any:
        """Return the object of user code that the node has: it lives from configure to cleanup."""
        return self.node(name)._behavior

    def change(self, node: str, *transitions: str) -> None:
        """Let a node go through transitions, one after the other."""
        running_node = self.node(node)
        for transition in transitions:
            # Told when all is done: the state is there before entities are given back.
            made = running_node.loop.run_task(running_node.lifecycle.change(transition))
            goal = _GOALS[transition]
            wait_until(made.done, f"{node} {goal}")
            assert running_node.state == goal

    def wait_for_listener(self, node: str, publisher: str) -> None:
        """Wait until a publisher knows who listens outside: what it sends before is lost."""
        port: Any = self.node(node)._entities.publishers[publisher]
        wait_until(port._publisher.get_subscription_count, f"a listener to {publisher} of {node}")

    def log(self) -> list[str]:
        return [event.message for event in self.reported(Logged)]

    def log_text(self) -> str:
        return "\n".join(self.log())

    def wait_for_log(self, part: str) -> str:
        wait_until(lambda: part in self.log_text(), f"'{part}' in the log")
        return next(line for line in self.log() if part in line)

    def stop(self) -> Outcome:
        """Stop, if it runs, and return how it ended."""
        self.host.stop("the test is over")
        return self.end()

    def end(self) -> Outcome:
        """Wait for the end and return how it was. Raises what the host raised."""
        self._thread.join(PATIENCE_S)
        assert not self._thread.is_alive(), "the host did not come to an end"
        return self._outcome.result()

    def summary(self, node: str) -> NodeSummary:
        """Stop and return what ``node`` did."""
        return next(entry for entry in self.stop().nodes if entry.node == node)


@contextmanager
def running(
    text: str,
    folder: Path,
    *,
    options: HostOptions | None = None,
    autostart: PrimaryState | None = None,
    **modules: str,
) -> Iterator[RunningSystem]:
    """Run a system for the length of the block, which begins when it is up.

    By default it gets more time for its end than people give it: what is not given back in time
    stays in this process, and the next test would ask it instead of a node of its own.
    """
    options = options or HostOptions(stop_within_s=_ENDS_WITHIN_S)
    system = RunningSystem(system_of(text, folder, **modules), options, autostart)
    try:
        wait_until(lambda: system.reported(BroughtUp) or not system._thread.is_alive(), "bring-up")
        yield system
    finally:
        system.stop()


class Peer:
    """A node as anybody would write it, in a participant of its own."""

    def __init__(self) -> None:
        remove_incomplete_ports()
        self.context = Context()
        self.context.init([])
        self.node = Node(f"peer_{os.getpid()}", context=self.context)
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._executor.shutdown()
        self.context.try_shutdown()
        self._thread.join(PATIENCE_S)
        leave(self.node)

    def join(self, name: str) -> Node:
        """Return one more node of the same participant."""
        node = Node(f"{name}_{os.getpid()}", context=self.context)
        self._executor.add_node(node)
        return node

    def run(self, function: Callable[[], Any]) -> Any:
        """Call it on the thread that serves the node; rclpy's action clients want that."""
        return finished(self._executor.create_task(function))

    def listen(self, kind: Any, topic: str, qos: QoSProfile | int = 10) -> list[Any]:
        """Return the list that messages will be in, once a publisher has been found."""
        heard: list[Any] = []
        self.node.create_subscription(kind, topic, heard.append, qos)
        wait_until(lambda: self.node.count_publishers(topic) > 0, f"a publisher of {topic}")
        return heard

    def publisher(self, kind: Any, topic: str, qos: QoSProfile | int = 10) -> Any:
        """Return a publisher that a subscription has been matched with."""
        publisher = self.node.create_publisher(kind, topic, qos)
        wait_until(lambda: publisher.get_subscription_count() > 0, f"a subscription of {topic}")
        return publisher

    def client(self, kind: Any, name: str) -> Any:
        client = self.node.create_client(kind, name)
        wait_until(client.service_is_ready, f"service {name}")
        return client

    def servers(self, name: str) -> set[bytes]:
        """Return whose requests to a service go to, as far as the peer knows by now.

        Who asks a node that is being made anew must wait for the new one: what is sent to the old
        one is lost.
        """
        ends = self.node.get_subscriptions_info_by_topic(f"rq{name}Request", no_mangle=True)
        return {bytes(end.endpoint_gid) for end in ends}

    def call(self, kind: Any, name: str, request: Any = None) -> Any:
        return finished(self.client(kind, name).call_async(request or kind.Request()))

    def change(self, node: str, transition: str | int) -> bool:
        """Ask for a transition by its label or its id; return the answer."""
        wanted = (
            Transition(label=transition)
            if isinstance(transition, str)
            else Transition(id=transition)
        )
        request = ChangeState.Request(transition=wanted)
        return bool(self.call(ChangeState, f"{node}/change_state", request).success)

    def state(self, node: str) -> str:
        return str(self.call(GetState, f"{node}/get_state").current_state.label)

    def set_parameter(self, node: str, name: str, value: Any) -> str:
        """Return why the new value was refused; empty when it was taken."""
        message: ParameterMessage = Parameter(name, value=value).to_parameter_msg()
        request = SetParameters.Request(parameters=[message])
        result = self.call(SetParameters, f"{node}/set_parameters", request).results[0]
        assert result.successful or result.reason
        return str(result.reason)

    def _spin(self) -> None:
        with suppress(ExternalShutdownException):
            self._executor.spin()


def finished(future: Any) -> Any:
    """Wait for an rclpy future that an executor completes."""
    wait_until(future.done, "an answer")
    return future.result()
