"""A system that runs in this process, and a hand-written peer, for tests."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Coroutine, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from textwrap import dedent
from typing import Any, TypeVar

from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.srv import SetParameters
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile

from composer.base.diagnostics import has_errors
from composer.client.systems.local_queries import local_report
from composer.language.document import parse_bytes
from composer.language.expand import expand
from composer.model import Node as DeclaredNode
from composer.model import Port, PrimaryState, System
from composer.model.resolve import resolve
from composer.plan import bring_up, tear_down
from composer.project import Project
from composer.project.node_types import NodeTypes
from composer.runtime.host import Host
from composer.runtime.host_options import HostOptions
from composer.runtime.middleware.local_resources import remove_incomplete_ports
from composer.runtime.node.node import RunningNode
from composer.runtime.protocol.reports import ChainFigures, SystemReport
from composer.runtime.ros.graph import servers_of
from composer.runtime.supervision.events import (
    BroughtUp,
    Event,
    Logged,
    NodeFailed,
    NodeSummary,
    Outcome,
    StateChanged,
)
from tests.ros.support.service_calls import ServiceUser, ids_of, leave

#: Longer than a participant is known whose goodbye message was lost: 20 s.
PATIENCE_S = 60.0
_ENDS_WITHIN_S = 20.0
_GOALS = {
    "configure": "inactive",
    "activate": "active",
    "deactivate": "inactive",
    "cleanup": "unconfigured",
}
E = TypeVar("E", bound=Event)
T = TypeVar("T")
N = TypeVar("N", bound=Node)
#: What a spin may raise while its executor and context are shut down.
_DESTROYED = (rclpy_implementation.RCLError, rclpy_implementation.InvalidHandle)


def wait_until(condition: Callable[[], T | None], what: str = "", limit_s: float = PATIENCE_S) -> T:
    """Wait until ``condition()`` is true, and return it; fail after ``limit_s``."""
    until_s = time.monotonic() + limit_s
    while not (found := condition()):
        assert time.monotonic() < until_s, f"timed out: {what or condition}"
        time.sleep(0.002)
    return found


def end_limit_s() -> float:
    """Return how long the end of a system may take, with the delays of a busy machine.

    It is less than the 6 s and more that anything takes that an end must not wait for.
    """
    return max(5.0, 2.0 * os.getloadavg()[0] / (os.cpu_count() or 1))


def system_of(text: str, folder: Path, **modules: str) -> System:
    """Return the system that ``text`` declares; ``modules`` become Python files next to it.

    No rule is checked: the runtime must also withstand systems that the rules would refuse.
    """
    for name, content in modules.items():
        folder.joinpath(f"{name}.py").write_text(dedent(content), encoding="utf-8")
    tree, source, diagnostics = parse_bytes(dedent(text).encode(), "system.yaml")
    assert tree is not None, diagnostics
    expanded, more, *_ = expand(tree, {})
    diagnostics += more
    node_types = NodeTypes.of(Project.at(folder))
    system, more = resolve(expanded, source, node_types, folders={source.path: folder})
    diagnostics += more
    assert system is not None, diagnostics
    assert not has_errors(diagnostics), diagnostics
    return system


class _Behaviors:
    """The behaviors of a system, by the keys of their nodes; changes nothing of it."""

    def __init__(self) -> None:
        self.latest: dict[str, Any] = {}

    def receiver(self, _: Port, receiver: T) -> T:
        return receiver

    def behavior(self, node: DeclaredNode, behavior: object) -> None:
        self.latest[node.name.value] = behavior

    def callback(self, _node: str, _name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        return function

    def timer(self, _node: str, _timer: str, tick: Callable[[], None]) -> Callable[[], None]:
        return tick


class RunningSystem:
    """A host on a thread of this process, and the events that it reported."""

    def __init__(
        self, system: System, options: HostOptions, autostart: PrimaryState | None
    ) -> None:
        self.events: list[Event] = []
        up = bring_up(system, autostart)
        self._name = system.name.value
        self._behaviors = _Behaviors()
        options = replace(options, instruments=self._behaviors)
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
        """Return the state changes, in order: ``/talker active``."""
        changes = [str(event) for event in self.reported(StateChanged)]
        return changes if node is None else [text for text in changes if text.startswith(node)]

    def wait_for_failure(self, node: str) -> NodeFailed:
        """Return the first fault of a node."""

        def failures() -> list[NodeFailed]:
            return [event for event in self.reported(NodeFailed) if node in event.nodes]

        return wait_until(failures, f"a fault of {node}")[0]

    def node(self, name: str) -> RunningNode:
        """Return a node of the system by its key."""
        node: Any = self.host.nodes[name]
        return node  # type: ignore[no-any-return]

    def behavior(self, name: str) -> Any:
        """Return the behavior of a node since it was last configured."""
        return self._behaviors.latest[name]

    def ros_node(self, name: str) -> Node:
        """Return the node of rclpy that a node of the system has."""
        return self.node(name).contexts[0].node

    def spawn(self, name: str, work: Coroutine[Any, Any, object]) -> None:
        """Run a coroutine as one of a behavior's."""
        self.node(name).contexts[0].spawn(work)

    def sender(self, node: str, publisher: str) -> Any:
        """Return a publisher as a behavior has it."""
        return self.behavior(node).publishers[publisher]

    def report(self) -> SystemReport:
        """Return what the system reports about itself."""
        return wait_until(lambda: local_report(self._name, PATIENCE_S), "the report")

    def chains(self) -> tuple[ChainFigures, ...]:
        """Return how long data has taken on the chains."""
        return self.host.chains()

    def change(self, node: str, *transitions: str) -> None:
        """Run transitions of a node, one after the other."""
        running_node = self.node(node)
        for transition in transitions:
            # The state changes before entities are destroyed; the future is done after that.
            future = running_node.loop.run_task(running_node.lifecycle.change(transition))
            goal = _GOALS[transition]
            wait_until(future.done, f"{node} {goal}")
            assert running_node.state == goal

    def publisher(self, node: str, name: str) -> Publisher:
        """Return the publisher of rclpy that a port has."""
        port = self.node(node).model.port(name)
        assert port is not None
        found = (end for end in self.ros_node(node).publishers if end.topic_name == port.full_name)
        return next(found)

    def wait_for_listener(self, node: str, publisher: str) -> None:
        """Wait until a publisher has an external subscription; earlier messages are lost."""
        of_rclpy = self.publisher(node, publisher)
        wait_until(of_rclpy.get_subscription_count, f"a subscription of {publisher}")

    def has_server(self, node: str, service: str) -> bool:
        """Return whether the client of a node has discovered the server of a service."""
        clients = self.ros_node(node).clients
        return any(end.srv_name == service and end.service_is_ready() for end in clients)

    def log(self) -> list[str]:
        return [event.message for event in self.reported(Logged)]

    def log_text(self) -> str:
        return "\n".join(self.log())

    def wait_for_log(self, part: str) -> str:
        wait_until(lambda: part in self.log_text(), f"'{part}' in the log")
        return next(line for line in self.log() if part in line)

    def has_ended(self) -> bool:
        return not self._thread.is_alive()

    def stop(self) -> Outcome:
        """Stop the system, if it runs, and return the outcome."""
        self.host.stop("the test is over")
        return self.end()

    def end(self) -> Outcome:
        """Wait for the end and return the outcome. Raises what the host raised."""
        self._thread.join(PATIENCE_S)
        assert not self._thread.is_alive(), "the host did not end"
        return self._outcome.result()

    def summary(self, node: str) -> NodeSummary:
        """Stop and return the summary of ``node``."""
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
    """Run a system for the length of the block, which starts when it is up.

    By default, its tear-down has more time than usual: nodes that are not destroyed in time remain
    in this process and would answer requests of the next test.
    """
    options = options or HostOptions(stop_within_s=_ENDS_WITHIN_S)
    system = RunningSystem(system_of(text, folder, **modules), options, autostart)
    try:
        wait_until(lambda: system.reported(BroughtUp) or system.has_ended(), "bring-up")
        yield system
    except AssertionError as error:
        error.add_note("the system reported:\n" + "\n".join(map(str, system.events)))
        raise
    finally:
        system.stop()


class Peer(ServiceUser):
    """A hand-written node in a participant of its own."""

    def __init__(self) -> None:
        remove_incomplete_ports(int(os.environ["ROS_DOMAIN_ID"]))
        self.context = Context()
        self.context.init([])
        super().__init__(Node(f"peer_{os.getpid()}", context=self.context))
        self._joined: list[Node] = []
        self._is_closing = False
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def wait_until(self, condition: Callable[[], Any], what: str = "") -> object:
        return wait_until(condition, what)

    def close(self) -> None:
        self._is_closing = True
        self._executor.shutdown()
        self._thread.join(PATIENCE_S)
        self.context.try_shutdown()
        # Each: a lifecycle node would keep the participant, and so all services, in the ROS graph.
        for node in (*self._joined, self.node):
            leave(node)

    def join(self, name: str, kind: type[N] = Node) -> N:  # type: ignore[assignment]
        """Return one more node of the same participant."""
        node = kind(f"{name}_{os.getpid()}", context=self.context)
        self._joined.append(node)
        self._executor.add_node(node)
        return node

    def run(self, function: Callable[[], Any]) -> Any:
        """Call ``function`` on the thread of the executor, as rclpy's action clients require."""
        return finished(self._executor.create_task(function))

    def listen(self, kind: Any, topic: str, qos: QoSProfile | int = 10) -> list[Any]:
        """Subscribe, wait for a publisher, and return the list that receives the messages."""
        messages: list[Any] = []
        self.node.create_subscription(kind, topic, messages.append, qos)
        wait_until(lambda: self.node.count_publishers(topic) > 0, f"a publisher of {topic}")
        return messages

    def publisher(self, kind: Any, topic: str, qos: QoSProfile | int = 10) -> Any:
        """Return a publisher with a matched subscription."""
        publisher = self.node.create_publisher(kind, topic, qos)
        wait_until(lambda: publisher.get_subscription_count() > 0, f"a subscription of {topic}")
        return publisher

    def servers(self, name: str) -> set[bytes]:
        """Return the ids of the servers of a service that the peer has discovered.

        Requests to a node that is being created again are lost until the new server is discovered.
        """
        return ids_of(servers_of(self.node, name))

    change = ServiceUser.change_state

    def wait_until_known(self, node: str) -> None:
        """Wait until the process of a node has discovered everything that this one has created.

        Before, a server loses its responses.
        """
        self._services.wait_until_acquainted(f"{node}/get_state")

    def set_parameter(self, node: str, name: str, value: Any) -> str:
        """Return why the new value was refused; empty if it was accepted."""
        message: ParameterMessage = Parameter(name, value=value).to_parameter_msg()
        request = SetParameters.Request(parameters=[message])
        result = self.call(SetParameters, f"{node}/set_parameters", request).results[0]
        assert result.successful or result.reason
        return str(result.reason)

    def _spin(self) -> None:
        try:
            self._executor.spin()
        except (ExternalShutdownException, *_DESTROYED):
            if not self._is_closing:
                raise


def finished(future: Any) -> Any:
    """Wait for an rclpy future that an executor completes, or a :class:`.Call`."""
    wait_until(future.done, "a response")
    return future.result()
