"""The service port."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine
from typing import Any

from composer.model import Port
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.log import describe
from composer.runtime.callbacks.queue import line_for
from composer.runtime.callbacks.reactions import RunningReaction
from composer.runtime.callbacks.timing import CallbackTimer
from composer.runtime.executors.loop import Reply
from composer.runtime.executors.tasks import Cancelled
from composer.runtime.executors.user_code import calls_user_code
from composer.runtime.intra_process.service import Server
from composer.runtime.ports.port import callback_group
from composer.runtime.ros.messages import interface_class
from composer.runtime.ros.qos_profiles import rclpy_profile

Handler = Callable[[Any, Any], Any]


class Request:
    """A request that has come, and the way back to whoever asked. Answered once."""

    __slots__ = ("_open", "_reply", "content")

    def __init__(self, content: Any, reply: Reply, still_open: set[Request]) -> None:
        self.content = content
        self._reply = reply
        self._open = still_open
        still_open.add(self)

    def answer(self, response: Any) -> None:
        """Send ``response``, unless there was an answer already."""
        if self in self._open:
            self._open.discard(self)
            self._reply(response)


class ServicePort:
    """Answers every request, so that nobody waits for an answer that never comes.

    While the node is active the port's reaction and handler answer, otherwise a refusal does.
    A refusal, and what is answered for a handler that failed, has ``success`` false and the reason
    in ``message`` where the response has such fields; otherwise the fields keep their defaults and
    the log alone has the reason.
    """

    def __init__(
        self,
        core: NodeContext,
        port: Port,
        reaction: RunningReaction | None,
        handler: Handler | None,
    ) -> None:
        self._core = core
        self._name = port.name.value
        self._type = interface_class(port.interface.value)
        self._response_type: Any = self._type.Response
        self._explains = _explains(self._response_type)
        self._reaction = reaction
        self._handler = handler
        self._open: set[Request] = set()
        # Whoever asks waits for an answer and gives up in time, so none is pushed out.
        traced = core.statistics.callback(port.kind.value, self._name)
        self._line = line_for(
            core,
            self._work,
            CallbackTimer(core, traced, port.budget_ms),
            depth=None,
            reentrant=port.reentrant,
        )
        self._service = core.node.create_service(
            self._type,
            port.full_name,
            _never_called,
            qos_profile=rclpy_profile(port.qos.profile),
            callback_group=callback_group(core, port),
        )
        core.loop.add_service(self._service, self.receive)
        server = Server(port, self._type, core.loop.call_soon, self.receive)
        self._leave = core.delivery.add_server(port, server)

    def receive(self, content: Any, reply: Reply) -> None:
        """Take a request that has come."""
        request = Request(content, reply, self._open)
        if not self._core.gate.incoming:
            self._refuse(request)
            return
        self._core.statistics.calls += 1
        self._line.put(request)

    def activate(self) -> None:
        """Do nothing: requests get in as soon as the gate is open."""

    def deactivate(self) -> None:
        """Refuse what waits."""
        for request in self._line.clear():
            self._refuse(request)

    def destroy(self) -> None:
        """Answer what is still open and leave."""
        self._leave()
        for request in tuple(self._open):
            self._refuse(request)
        self._core.loop.remove(self._service)
        self._core.node.destroy_service(self._service)

    def _refuse(self, request: Request) -> None:
        reason = self._core.gate.refusal
        if not self._explains:
            self._core.log.warn(f"service '{self._name}' refuses a request: {reason}")
        request.answer(self._failure(reason))

    def _failure(self, reason: str) -> Any:
        response = self._response_type()
        if self._explains:
            response.message = reason
        return response

    @calls_user_code
    def _work(self, request: Request) -> Coroutine[Any, Any, None] | None:
        response = None
        if self._reaction is not None:
            try:
                response = self._reaction.run(request=request.content)
            except Exception as error:
                self._failed(request, f"service '{self._name}'", error)
                return None
        if response is None:
            response = self._response_type()
        if self._handler is None:
            request.answer(response)
            return None
        try:
            result = self._handler(request.content, response)
        except BaseException as error:
            self._failed(request, self._callback, error)
            return None
        if not isinstance(result, self._response_type) and isinstance(result, Awaitable):
            return self._answer_later(request, result)
        self._answer(request, result)
        return None

    @property
    def _callback(self) -> str:
        return f"on_{self._name}"

    @calls_user_code
    async def _answer_later(self, request: Request, result: Awaitable[Any]) -> None:
        try:
            self._answer(request, await result)
        except (Cancelled, GeneratorExit):
            self._refuse(request)
            raise
        except BaseException as error:
            request.answer(self._failure(f"{self._callback}: {describe(error)}"))
            self._core.take(self._callback, error)

    def _answer(self, request: Request, result: Any) -> None:
        if isinstance(result, self._response_type):
            request.answer(result)
            return
        wanted = f"{self._type.__name__}.Response"
        text = f"returned {result!r:.80}, not a {wanted}"
        self._core.error_log.error(self._callback, text)
        request.answer(self._failure(f"{self._callback} {text}"))

    def _failed(self, request: Request, callback: str, error: BaseException) -> None:
        self._core.error_log.exception(callback, error)
        request.answer(self._failure(f"{callback}: {describe(error)}"))


def _explains(response_type: Any) -> bool:
    """Say whether the response has the usual fields to say that and why it failed."""
    fields = response_type.get_fields_and_field_types()
    return bool(fields.get("success") == "boolean" and fields.get("message") == "string")


def _never_called(_: Any, response: Any) -> Any:
    """Stand where rclpy wants a callback; the loop calls ``receive`` instead."""
    return response
