"""The interface between nodes and the loops that call their callbacks.

Nodes know a :class:`Loop` but no executor. There are two kinds: the composer's own event loop, and
rclpy's wait-set executors.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any, Protocol, TypeVar

from rclpy.action.client import ActionClient
from rclpy.action.server import ActionServer
from rclpy.client import Client
from rclpy.node import Node
from rclpy.service import Service
from rclpy.subscription import Subscription

from composer.runtime.executors.futures import Future

T = TypeVar("T")

#: Called with (what was running, the exception). The loop reports it and continues.
ExceptionHandler = Callable[[str, BaseException], None]


class Awaited(Protocol):
    """A future of rclpy or of the composer, as far as a loop waits for it."""

    def done(self) -> bool:
        """Return whether it has a result or an exception."""

    def add_done_callback(self, callback: Callable[[Any], object]) -> object:
        """Call ``callback`` once it is done."""


class Reply(Protocol):
    """Ends one request, once."""

    def __call__(self, response: Any, /) -> None:
        """Send the response."""

    def refuse(self, error: BaseException) -> None:
        """Send no response; a caller in this process gets the error."""


#: A message and the middleware's information about it.
Taken = tuple[Any, Any]


def unused_callback(_: Any, response: Any) -> Any:
    """Satisfy rclpy, which requires a service callback; the loop calls another one."""
    return response


class TimerHandle(Protocol):
    """A scheduled call. Canceling it twice is harmless."""

    @property
    def late_s(self) -> float:
        """How long ago the call was due, in seconds. Valid during the call."""

    def cancel(self) -> None:
        """Never call again."""


class Loop(Protocol):
    """Calls callbacks on one or several threads. Methods may be called from any thread.

    An exception of a callback, SystemExit and KeyboardInterrupt included, goes to the exception
    handler with the callback's name, and the loop continues. An entity is served from when it is
    added, including what it received before, until it is removed.
    """

    @property
    def name(self) -> str:
        """The name of the executor in YAML."""

    def add_node(self, node: Node) -> None:
        """Serve the entities that rclpy creates for a node: parameter and logger services.

        Everything the node has now is served by its own callbacks. Of what it gets later, only the
        simulated clock and QoS events are served; other entities must be added.
        """

    def remove_node(self, node: Node) -> None:
        """Stop serving the node and all its entities. Call it before the node is destroyed."""

    def add_subscription(
        self, subscription: Subscription, callback: Callable[[Taken], None]
    ) -> None:
        """Call ``callback((message, information))`` for each message."""

    def add_service(self, service: Service, callback: Callable[[Any, Reply], None]) -> None:
        """Call ``callback(request, reply)``; ``reply(response)`` responds, now or later.

        If ``callback`` raises, the client gets an empty response. ``reply`` raises TypeError for
        another type than the service's response, RuntimeError if there was a response already.
        """

    def add_client(self, client: Client) -> None:
        """Complete the futures of ``client.call_async``."""

    def add_action_server(self, server: ActionServer) -> None:
        """Handle the server's goal, cancel and result requests.

        If one of its callbacks raises, the goal is rejected or aborted, the cancellation rejected.
        """

    def add_action_client(self, client: ActionClient) -> None:
        """Complete the futures of the client and deliver its feedback."""

    def remove(self, entity: object) -> None:
        """Stop serving an entity. Call it before the entity is destroyed."""

    def call_soon(self, callback: Callable[[], object]) -> None:
        """Call ``callback`` on the loop as soon as it is free."""

    def call_later(self, delay_s: float, callback: Callable[[], object]) -> TimerHandle:
        """Call ``callback`` once, ``delay_s`` seconds from now."""

    def call_every(self, period_s: float, callback: Callable[[], object]) -> TimerHandle:
        """Call ``callback`` each ``period_s`` seconds; a late call does not shift the next."""

    def run_task(self, coroutine: Coroutine[Any, Any, T]) -> Future[T]:
        """Run a coroutine; return the future of its result.

        Canceling the future throws ``Cancelled`` into the coroutine where it awaits. An exception
        that is never retrieved from the future is reported.
        """

    def run(self, function: Callable[[], T], timeout_s: float | None = None) -> T:
        """Call ``function`` on the loop and wait for it; on the loop itself, call it at once.

        Raises what ``function`` raises; TimeoutError with the loop's stack if it takes longer,
        after which it is not started; and RuntimeError if the loop has stopped.
        """

    def is_current(self) -> bool:
        """Return whether the calling thread is in a callback of the loop."""

    def wait_for(self, future: Awaited, timeout_s: float | None = None) -> bool:
        """Block until ``future`` is done; return false if that takes longer, or the loop stops.

        An event loop gives itself another thread meanwhile. A thread of another loop only blocks,
        so that its other threads have to complete the future.
        """

    def begin_blocking(self, *, expected: bool) -> Any:
        """Begin a call of code that may block; return what :meth:`end_blocking` needs.

        If it is ``expected`` to block, another thread serves an event loop at once.
        """

    def end_blocking(self, began: Any) -> bool:
        """End a call of code that may block; return whether it has blocked."""

    def hand_over_blocked(self) -> bool:
        """Let another thread serve an event loop if a call that began to block has not ended.

        It is called periodically: a call that has begun before the last time blocks. Returns
        whether there is a call that may.
        """

    def start(self) -> None:
        """Start the threads of the loop."""

    def native_thread_ids(self) -> tuple[int, ...]:
        """Return Linux's ids of all threads of the loop, once it was started."""

    def stop(self, timeout_s: float) -> bool:
        """Stop the threads; return false if a callback did not return in time.

        Tasks are canceled and get a moment to clean up. On the loop itself, this requests the stop
        and returns false.
        """

    def current_stack(self) -> str:
        """Return the Python stacks of the callbacks that run now; empty if none does."""

    def busy_threads(self) -> tuple[int, ...]:
        """Return the identifiers of the threads that are in a callback now."""
