"""A service as clients of the same process see it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any
from weakref import ref

from composer.model import Isolation, Port
from composer.runtime.executors.futures import Future
from composer.runtime.intra_process.copying import copy_of

CallSoon = Callable[[Callable[[], object]], None]
Receive = Callable[[Any, Any], None]


class LocalService:
    """Passes requests to ``receive`` on the service's loop, and responses back."""

    def __init__(self, port: Port, service_type: Any, call_soon: CallSoon, receive: Receive):
        self._name = port.full_name
        self._response_type = service_type.Response
        self._call_soon = call_soon
        self._receive = receive
        self._isolated = port.isolation is Isolation.COPY

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
            reply(self._response_type())
            raise

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

    def refuse(self, error: BaseException) -> None:
        """Fail the caller's future."""
        future = self._waiting()
        if future is not None:
            future.set_exception(error)
