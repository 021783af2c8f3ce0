"""Services and action servers as clients of the same process see them.

Goals are goals of rclpy's server like any other: other processes see their status, receive their
feedback and may cancel them. Only what the client itself receives bypasses DDS.
"""

from __future__ import annotations

import random
import uuid
from collections.abc import Callable, Coroutine
from functools import partial
from typing import Any
from weakref import ref

from rclpy.action.server import ActionServer
from unique_identifier_msgs.msg import UUID

from composer.base.fast_dataclass import dataclass
from composer.model import Isolation, Port
from composer.runtime.executors import actions
from composer.runtime.executors.actions import GoalServer
from composer.runtime.executors.futures import Future
from composer.runtime.intra_process.publisher import copy_of

CallSoon = Callable[[Callable[[], object]], None]
Receive = Callable[[Any, Any], None]
Spawn = Callable[[Coroutine[Any, Any, Any]], Future[Any]]
OnFeedback = Callable[[Any], None]
_IDS = random.Random()  # noqa: S311 - they identify, and protect nothing


class LocalService:
    """Passes requests to ``receive`` on the service's loop, and responses back."""

    def __init__(
        self,
        full_name: str,
        service_type: Any,
        call_soon: CallSoon,
        receive: Receive,
        isolation: Isolation = Isolation.COPY,
    ) -> None:
        self._name = full_name
        self._response_type = service_type.Response
        self._call_soon = call_soon
        self._receive = receive
        self._isolated = isolation is Isolation.COPY

    def call(self, request: Any, response: Future[Any]) -> None:
        """Send a request, from any thread; it sets the result of ``response``.

        As by DDS, a callback that raises sends an empty response. The caller owns ``response``:
        the service refers to it weakly.
        """
        content = copy_of(request) if self._isolated else request
        self._call_soon(partial(self._serve, content, _LocalReply(self, ref(response))))

    def _serve(self, request: Any, reply: _LocalReply) -> None:
        try:
            self._receive(request, reply)
        except BaseException:
            reply.send_empty()
            raise

    def empty(self) -> Any:
        """Return an empty response."""
        return self._response_type()

    def checked(self, response: Any) -> Any:
        """Return a response as the caller gets it. Raises TypeError."""
        if not isinstance(response, self._response_type):
            raise TypeError(f"service '{self._name}': {type(response).__name__} is not a response")
        return copy_of(response) if self._isolated else response


class _LocalReply:
    """Ends one request of this process."""

    __slots__ = ("_service", "_waiting")

    def __init__(self, service: LocalService, waiting: ref[Future[Any]]) -> None:
        self._service = service
        self._waiting = waiting

    def __call__(self, response: Any) -> None:
        """Set the result of the caller's future. Raises TypeError."""
        checked = self._service.checked(response)
        future = self._waiting()
        if future is not None:
            future.set_result(checked)

    def send_empty(self) -> None:
        """Set an empty result, as by DDS if a callback raises."""
        self(self._service.empty())

    def refuse(self, error: BaseException) -> None:
        """Fail the caller's future."""
        future = self._waiting()
        if future is not None:
            future.set_exception(error)


class LocalActionServer:
    """Passes goals and cancel requests to the server's loop, and feedback and results back."""

    def __init__(self, port: Port, server: ActionServer, spawn: Spawn) -> None:
        """``spawn`` runs a coroutine on the server's loop."""
        self._server = server
        self._spawn = spawn
        self._passed: Callable[[Any], Any] = _itself
        if port.isolation is Isolation.COPY:
            self._passed = copy_of
        self._listeners: dict[bytes, OnFeedback] = {}

    def send_goal(
        self, goal: Any, on_feedback: OnFeedback, goal_id: UUID | None = None
    ) -> Future[LocalGoal]:
        """Send a goal, from any thread; return the future of its handle, accepted or not.

        ``on_feedback`` is called on the server's loop. The goal has a random id by default.
        """
        handle = LocalGoal(goal_id or new_goal_id(), self)
        sent: Future[LocalGoal] = Future()
        self._spawn(self._on_goal(handle, self._passed(goal), on_feedback, sent))
        return sent

    def publish_feedback(self, goal_id: bytes, feedback: Any) -> None:
        """Pass feedback to the client of this process that has sent the goal, if any."""
        listener = self._listeners.get(goal_id)
        if listener is not None:
            listener(self._passed(feedback))

    def result(self, handle: LocalGoal) -> Future[Any]:
        """Return the future of the result response, as by DDS."""
        response: Future[Any] = Future()
        self._spawn(self._on_result_request(handle, response))
        return response

    def cancel(self, handle: LocalGoal) -> Future[Any]:
        """Request cancellation; return the future of the cancel response, as by DDS."""
        response: Future[Any] = Future()
        self._spawn(self._on_cancel_request(handle, response))
        return response

    async def _on_goal(
        self, handle: LocalGoal, goal: Any, on_feedback: OnFeedback, sent: Future[LocalGoal]
    ) -> None:
        identity = bytes(handle.goal_id.uuid)
        self._listeners[identity] = on_feedback

        def respond(accepted: bool) -> None:
            if not accepted:
                del self._listeners[identity]
            handle.accepted = accepted
            sent.set_result(handle)

        await actions.execute_goal_request(self._server, handle.goal_id, goal, respond)

    async def _on_result_request(self, handle: LocalGoal, response: Future[Any]) -> None:
        identity = bytes(handle.goal_id.uuid)

        def respond(result: Any) -> None:
            self._listeners.pop(identity, None)
            if isinstance(self._server, GoalServer):
                self._server.discard_result(identity)
            result.result = self._passed(result.result)
            response.set_result(result)

        actions.add_result_callback(self._server, identity, respond)

    async def _on_cancel_request(self, handle: LocalGoal, response: Future[Any]) -> None:
        response.set_result(await actions.execute_cancel_request(self._server, handle.goal_id))


@dataclass(slots=True, eq=False)
class LocalGoal:
    """A goal as its client holds it: what is used of ``rclpy.action.client.ClientGoalHandle``."""

    goal_id: UUID
    server: LocalActionServer
    accepted: bool = False

    def get_result_async(self) -> Future[Any]:
        """Return the future of the result."""
        return self.server.result(self)

    def cancel_goal_async(self) -> Future[Any]:
        """Request cancellation."""
        return self.server.cancel(self)


def use_seed(seed: int) -> None:
    """Begin the sequence of ids, of :mod:`random` and of ``numpy.random`` that ``seed`` has.

    Generators that user code has created, such as ``numpy.random.default_rng()``, have their own.
    """
    _IDS.seed(seed)
    random.seed(seed)
    import numpy as np  # noqa: PLC0415 - its random numbers are slow to load

    np.random.seed(seed)


def new_goal_id() -> UUID:
    """Return a random id of a goal."""
    return UUID(uuid=list(uuid.UUID(int=_IDS.getrandbits(128), version=4).bytes))


def _itself(value: Any) -> Any:
    return value
