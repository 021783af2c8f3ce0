"""A command's own short-lived node in the ROS graph: it joins, waits on what it needs, leaves.

Discovery tells nobody when it is complete. Whoever knows a name waits for that name; whoever asks
what there is waits until the graph has stood still for a moment.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Hashable, Iterable
from types import TracebackType
from typing import Any, Self, TypeVar

from rclpy.client import Client
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future

T = TypeVar("T")
H = TypeVar("H", bound=Hashable)

_STEP_S = 0.02
#: A fresh process knows a hundred nodes after 0.7 s, but now and then it takes 2 s (measured,
#: Fast DDS): what is there is told once nothing has come for a moment, what is missing later.
QUIET_S = 0.5
MISSING_S = 3.0


class RosError(Exception):
    """Something asked of the ROS graph came to nothing; ``hint`` says what would not."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.hint = hint


class NoAnswer(RosError):
    """A node or a service of it did not do its part within the time limit."""


class Deadline:
    """A point in time that everything a command waits for shares."""

    def __init__(self, timeout_s: float) -> None:
        self.timeout_s = timeout_s
        self._end = time.monotonic() + timeout_s

    @property
    def left_s(self) -> float:
        """The seconds that are left, at least 0."""
        return max(0.0, self._end - time.monotonic())

    @property
    def passed(self) -> bool:
        """Whether nothing is left."""
        return self.left_s <= 0.0


class Session:
    """The node, hidden from node lists by its leading underscore. Use it in a ``with`` block."""

    def __init__(self) -> None:
        self.context = Context()
        # No signal handlers come with it: Ctrl-C stays Python's KeyboardInterrupt.
        self.context.init([])
        self.node = Node(
            f"_compose_{os.getpid()}",
            context=self.context,
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
        )
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._executor.shutdown(timeout_sec=1.0)
        self.node.destroy_node()
        self.context.try_shutdown()

    def spin_once(self, deadline: Deadline) -> None:
        """Wait for something to come in, for a moment and not beyond the deadline."""
        self._executor.spin_once(timeout_sec=min(_STEP_S, deadline.left_s))

    def wait_for(self, look: Callable[[], T | None], deadline: Deadline) -> T | None:
        """Return what ``look`` finds as soon as it finds something; None at the deadline."""
        while True:
            found = look()
            if found is not None or deadline.passed:
                return found
            self.spin_once(deadline)

    def wait_until_still(self, look: Callable[[], H], deadline: Deadline) -> H:
        """Return what ``look`` finds once it stays the same for a moment, or at the deadline.

        What is empty is given longer: it looks like that before the first node is discovered.
        """
        seen = look()
        changed_s = time.monotonic()
        while not deadline.passed:
            self.spin_once(deadline)
            now = look()
            if now != seen:
                seen, changed_s = now, time.monotonic()
            quiet_s = QUIET_S if seen else MISSING_S
            if time.monotonic() - changed_s >= quiet_s:
                break
        return seen

    def call(self, service: Any, name: str, request: Any, deadline: Deadline) -> Any:
        """Call a service and return its response. Raises NoAnswer at the deadline."""
        response = self.call_each(service, [name], request, deadline)[name]
        if response is None:
            raise NoAnswer(f"service '{name}' did not answer within {deadline.timeout_s:g} s")
        return response

    def call_each(
        self, service: Any, names: Iterable[str], request: Any, deadline: Deadline
    ) -> dict[str, Any]:
        """Call services of one type at once; None for those without an answer at the deadline."""
        calls = {name: _Call(self.node.create_client(service, name)) for name in names}
        try:
            open_calls = list(calls.values())
            while open_calls and not deadline.passed:
                open_calls = [call for call in open_calls if not call.advance(request)]
                self.spin_once(deadline)
            return {name: call.response for name, call in calls.items()}
        finally:
            for call in calls.values():
                self.node.destroy_client(call.client)


class _Call:
    """A service call that is sent as soon as the server is there."""

    def __init__(self, client: Client) -> None:
        self.client = client
        self.response: Any = None
        self._future: Future | None = None

    def advance(self, request: Any) -> bool:
        """Do what can be done now; true once the response is there."""
        if self._future is None and self.client.service_is_ready():
            self._future = self.client.call_async(request)
        if self._future is not None and self._future.done():
            self.response = self._future.result()
        return self.response is not None
