"""How requests are served: in a running system, and in tests of behaviors, which need no ROS."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine
from typing import TYPE_CHECKING, Any

from composer.behavior import CallError, ServerUnavailable
from composer.model import Port
from composer.runtime.callbacks.user_code import UserCode, queue_for
from composer.runtime.executors.futures import Cancelled
from composer.runtime.executors.tracebacks import calls_user_code, describe, is_closing, shown
from composer.runtime.ports import RunningPort

if TYPE_CHECKING:
    from composer.runtime.callbacks.callback import CallbackTimer
    from composer.runtime.executors.sources import Reply

Handler = Callable[[Any, Any], Any]


class PendingRequest:
    """A request without a response. It is answered once."""

    __slots__ = ("_pending", "_reply", "content")

    def __init__(self, content: Any, reply: Reply, pending: set[PendingRequest]) -> None:
        self.content = content
        self._reply = reply
        self._pending = pending
        pending.add(self)

    def respond(self, response: Any) -> None:
        """Send ``response``, unless there was one already."""
        if self in self._pending:
            self._pending.discard(self)
            try:
                self._reply(response)
            except BaseException:  # it cannot be sent, but another one can
                self._pending.add(self)
                raise

    def refuse(self, error: CallError) -> None:
        """Send no response, unless there was one already."""
        if self in self._pending:
            self._pending.discard(self)
            self._reply.refuse(error)


class RequestServer(RunningPort):
    """Responds to requests by its reaction and handler while the node is active.

    Otherwise a request is refused. If a request is refused or its handler fails, the response has
    ``success`` false and the reason in ``message``, if it has such fields. A response without
    ``success`` would look like a result: there is none, a client in this process gets the error,
    and any other one waits until its time is over. See docs/decisions/0009-lifecycle-and-gate.md.
    """

    #: Runs the reaction, which may respond: ``react(request=...)``.
    _react: Callable[..., Any] | None = None

    def __init__(
        self,
        context: UserCode,
        port: Port,
        service_type: Any,
        handler: Handler | None,
        timer: CallbackTimer | None = None,
    ) -> None:
        """``timer`` times the requests."""
        self._context = context
        self._name = port.name.value
        self._full_name = port.full_name
        self._type = service_type
        self._response_type = service_type.Response
        response = self._response_type()
        self._can_fail = isinstance(getattr(response, "success", None), bool)
        self._has_reason = isinstance(getattr(response, "message", None), str)
        self._handler = handler
        self._pending: set[PendingRequest] = set()
        # Clients wait for a response and time out by themselves, so no request is dropped.
        self._queue = queue_for(context, self._handle, timer, depth=None, reentrant=port.reentrant)

    def on_request(self, content: Any, reply: Reply) -> None:
        """Handle a request."""
        request = PendingRequest(content, reply, self._pending)
        if not self._context.gate.incoming:
            self._refuse(request)
            return
        self._context.statistics.calls += 1
        self._queue.put(request)

    def deactivate(self) -> None:
        """Refuse the waiting requests."""
        for request in self._queue.clear():
            self._refuse(request)

    def destroy(self) -> None:
        """Refuse the pending requests."""
        for request in tuple(self._pending):
            self._refuse(request)

    def _refuse(self, request: PendingRequest) -> None:
        reason = self._context.gate.refusal
        if not (self._can_fail and self._has_reason):
            self._context.log.warn(f"service '{self._name}' refuses a request: {reason}")
        self._respond_with_failure(request, reason, ServerUnavailable)

    def _respond_with_failure(
        self, request: PendingRequest, reason: str, kind: type[CallError] = CallError
    ) -> None:
        if not self._can_fail:
            request.refuse(kind(f"service '{self._full_name}': {reason}"))
            return
        response = self._response_type()
        if self._has_reason:
            response.message = reason
        request.respond(response)

    @calls_user_code
    def _handle(self, request: PendingRequest) -> Coroutine[Any, Any, None] | None:
        response = None
        if self._react is not None:
            try:
                response = self._react(request=request.content)
            except Exception as error:
                self._fail(request, f"service '{self._name}'", error)
                return None
        if response is None:
            response = self._response_type()
        if self._handler is None:
            request.respond(response)
            return None
        try:
            result = self._handler(request.content, response)
            if not isinstance(result, self._response_type) and isinstance(result, Awaitable):
                return self._respond_later(request, result)
            self._respond(request, result)
        except BaseException as error:
            self._fail(request, self._callback, error)
        return None

    @property
    def _callback(self) -> str:
        return f"on_{self._name}"

    @calls_user_code
    async def _respond_later(self, request: PendingRequest, result: Awaitable[Any]) -> None:
        try:
            self._respond(request, await result)
        except Cancelled:
            self._refuse(request)
            raise
        except BaseException as error:
            if is_closing(error):
                self._refuse(request)
                raise
            self._respond_with_failure(request, f"{self._callback}: {describe(error)}")
            self._context.on_exception(self._callback, error)

    def _respond(self, request: PendingRequest, result: Any) -> None:
        if isinstance(result, self._response_type):
            request.respond(result)
            return
        text = f"returned {shown(result)}, not a {self._type.__name__}.Response"
        self._context.error_log.error(self._callback, text)
        self._respond_with_failure(request, f"{self._callback} {text}")

    def _fail(self, request: PendingRequest, callback: str, error: BaseException) -> None:
        self._context.error_log.exception(callback, error)
        self._respond_with_failure(request, f"{callback}: {describe(error)}")
