"""A command's own short-lived node in the ROS graph: it joins, waits on what it needs, leaves.

Discovery tells nobody when it is complete. Whoever knows a name waits for that name; whoever asks
what there is waits until the graph has stood still for a moment.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Hashable, Iterable
from typing import Any, Self, TypeVar

from rclpy.client import Client
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future

T = TypeVar("T")
H = TypeVar("H", bound=Hashable)

_STEP_S = 0.02
#: What is there is told once nothing has come for so long, what is missing after so long.
QUIET_S = 0.5
MISSING_S = 3.0
#: With Fast DDS a new participant is met at once or, in about half of the cases, only with the
#: next announcement up to 3 s later (measured). Joining anew is another throw of that coin.
_MEET_WITHIN_S = 0.25
_JOINS = 8
#: Commands do not count as somebody: they come and go.
_NAME_PREFIX = "_compose_"


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
        self._began_s = time.monotonic()
        self._join()
        for _ in range(_JOINS - 1):
            if self.wait_for(lambda: self.others() or None, Deadline(_MEET_WITHIN_S)):
                break
            self.rejoin()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._leave()

    def rejoin(self) -> None:
        """Leave and join anew: another throw of the coin whether others are met at once.

        Whatever was made with ``node`` is gone.
        """
        self._leave()
        self._join()

    def _join(self) -> None:
        self._context = Context()
        # No signal handlers come with it: Ctrl-C stays Python's KeyboardInterrupt.
        self._context.init([])
        self.node = Node(
            f"{_NAME_PREFIX}{os.getpid()}",
            context=self._context,
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)

    def _leave(self) -> None:
        self._executor.shutdown(timeout_sec=1.0)
        self.node.destroy_node()
        self._context.try_shutdown()

    def others(self) -> tuple[tuple[str, str], ...]:
        """Return name and namespace of every node known now but those of commands."""
        return tuple(
            sorted(
                (name, namespace)
                for name, namespace in self.node.get_node_names_and_namespaces()
                if not name.startswith(_NAME_PREFIX)
            )
        )

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

        Where no other node is known it waits longer: so it looks before the first is discovered.
        """
        seen = look()
        changed_s = time.monotonic()
        while not deadline.passed:
            self.spin_once(deadline)
            now = look()
            if now != seen:
                seen, changed_s = now, time.monotonic()
            still_at_s = changed_s + QUIET_S if self.others() else self._began_s + MISSING_S
            if time.monotonic() >= still_at_s:
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
