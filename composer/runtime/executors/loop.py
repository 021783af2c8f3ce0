"""The seam between the nodes and whoever calls their callbacks.

Nodes know a :class:`Loop` and nothing of executors. There are two kinds: the composer's own event
loop, and rclpy's wait-set executors for people who ask for them.
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

from composer.runtime.executors.tasks import Future

T = TypeVar("T")

#: Called with (what was running, the exception). Loops report here and go on.
ExceptionHandler = Callable[[str, BaseException], None]

Reply = Callable[[Any], None]
#: A message, and what the middleware tells about its way.
Taken = tuple[Any, Any]


def never_called(_: Any, response: Any) -> Any:
    """Stand where rclpy wants a service's callback: the loop calls another instead."""
    return response


class Timer(Protocol):
    """Something that will be called. Cancelling twice is harmless."""

    @property
    def late_s(self) -> float:
        """How long ago the call was due, in seconds. To be asked in that call."""

    def cancel(self) -> None:
        """Never call again."""


class Loop(Protocol):
    """Calls callbacks, one thread or several. Methods may be called from any thread.

    What a callback raises, SystemExit and KeyboardInterrupt included, goes to the exception handler
    with the callback's name, and the loop goes on. An entity is served once it was added: from then
    on with all it received before, and until it is removed.
    """

    @property
    def name(self) -> str:
        """The name of the executor in YAML."""

    def add_node(self, node: Node) -> None:
        """Serve what every node brings along: parameter, lifecycle and logger services.

        Everything the node has by now is served by its own callback; of what it gets later, the
        simulated clock and QoS events are. The rest is to be added.
        """

    def remove_node(self, node: Node) -> None:
        """Stop serving the node and everything of it. To be called before it is destroyed."""

    def add_subscription(
        self, subscription: Subscription, callback: Callable[[Taken], None]
    ) -> None:
        """Call ``callback((message, information))`` for each message."""

    def add_service(self, service: Service, callback: Callable[[Any, Reply], None]) -> None:
        """Call ``callback(request, reply)``; ``reply(response)`` answers, now or later.

        When ``callback`` raises, the caller gets an empty answer. ``reply`` raises TypeError for
        what is no response of the service, RuntimeError when it has answered already.
        """

    def add_client(self, client: Client) -> None:
        """Complete the futures of ``client.call_async``."""

    def add_action_server(self, server: ActionServer) -> None:
        """Run the server's goal, cancel and result requests.

        When a callback of it raises, the goal is rejected or aborted, the cancellation refused.
        """

    def add_action_client(self, client: ActionClient) -> None:
        """Complete the futures of the client and deliver its feedback."""

    def remove(self, entity: object) -> None:
        """Stop serving one entity. To be called before it is destroyed."""

    def call_soon(self, callback: Callable[[], object]) -> None:
        """Call ``callback`` on the loop as soon as it is free."""

    def call_later(self, delay_s: float, callback: Callable[[], object]) -> Timer:
        """Call ``callback`` once, ``delay_s`` seconds from now."""

    def call_every(self, period_s: float, callback: Callable[[], object]) -> Timer:
        """Call ``callback`` each ``period_s`` seconds; a late call does not shift the next."""

    def run_task(self, coroutine: Coroutine[Any, Any, T]) -> Future[T]:
        """Run a coroutine; the future is its outcome.

        Cancelling the future throws ``Cancelled`` into the coroutine where it awaits. An exception
        is reported when nobody asks the future for it.
        """

    def run(self, function: Callable[[], T], timeout_s: float | None = None) -> T:
        """Call ``function`` on the loop and wait for it (at once when already there).

        Raises what ``function`` raises, TimeoutError with the loop's stack when it takes longer (it
        is not begun after that), and RuntimeError when the loop has stopped.
        """

    def start(self) -> None:
        """Begin to call, on threads of the loop's own."""

    def thread_ids(self) -> tuple[int, ...]:
        """Return Linux's ids of all threads of the loop, once it was started."""

    def stop(self, timeout_s: float) -> bool:
        """End the threads; false when a callback did not return in time.

        Tasks are cancelled and get a moment to clean up. Called on the loop itself, this asks for
        the end and answers false.
        """

    def where(self) -> str:
        """Return the Python stack of the callback that runs now; empty when none does."""

    def threads(self) -> tuple[int, ...]:
        """Return the identifiers of the threads that are in a callback now."""
