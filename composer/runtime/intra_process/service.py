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
Reply = Callable[[Any], None]
Receive = Callable[[Any, Reply], None]


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
        self._call_soon(partial(self._serve, content, partial(self._reply, ref(response))))

    def _serve(self, request: Any, reply: Reply) -> None:
        try:
            self._receive(request, reply)
        except BaseException:
            reply(self._response_type())
            raise

    def _reply(self, waiting: ref[Future[Any]], response: Any) -> None:
        if not isinstance(response, self._response_type):
            raise TypeError(f"service '{self._name}': {type(response).__name__} is not a response")
        future = waiting()
        if future is not None:
            future.set_result(copy_of(response) if self._isolated else response)
