"""A service as the clients of its own process see it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from composer.model import Isolation, Port
from composer.runtime.delivery.copying import copy_of
from composer.runtime.delivery.queue import CallSoon
from composer.runtime.tasks import Future

Reply = Callable[[Any], None]
Receive = Callable[[Any, Reply], None]


class Server:
    """Hands requests to ``receive`` on the server's loop, and the answers back."""

    def __init__(self, port: Port, service_type: Any, call_soon: CallSoon, receive: Receive):
        self._name = port.full_name
        self._response_type = service_type.Response
        self._call_soon = call_soon
        self._receive = receive
        self._isolated = port.isolation is Isolation.COPY

    def ask(self, request: Any) -> Future[Any]:
        """Send a request, from any thread; the future is the response.

        As by DDS, a callback that raises gives an empty one.
        """
        answer: Future[Any] = Future()
        content = copy_of(request) if self._isolated else request
        self._call_soon(partial(self._serve, content, answer))
        return answer

    def _serve(self, request: Any, answer: Future[Any]) -> None:
        try:
            self._receive(request, partial(self._reply, answer))
        except BaseException:
            answer.set_result(self._response_type())
            raise

    def _reply(self, answer: Future[Any], response: Any) -> None:
        if not isinstance(response, self._response_type):
            raise TypeError(f"service '{self._name}': {type(response).__name__} is no response")
        answer.set_result(copy_of(response) if self._isolated else response)
