"""The service client port."""

from __future__ import annotations

from typing import Any

from composer.behavior import CallCancelled, CallError
from composer.model import Event, Port
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.reactions import RunningReaction
from composer.runtime.callbacks.timing import CallbackTimer
from composer.runtime.executors.tasks import Future, wrap_future
from composer.runtime.intra_process.service import Server
from composer.runtime.ports.waiting import Waiting
from composer.runtime.ros.messages import interface_class
from composer.runtime.ros.qos_profiles import rclpy_profile

#: The limit of a call when the YAML names none.
DEFAULT_TIMEOUT_MS = 5000.0


class ClientPort:
    """Calls a service. What comes back goes to the caller and to the port's own reactions."""

    def __init__(self, core: NodeContext, port: Port) -> None:
        self._core = core
        self._find_server = core.delivery.find_server(port)
        self._name = port.name.value
        self._timeout_ms = DEFAULT_TIMEOUT_MS if port.timeout_ms is None else port.timeout_ms.value
        self._what = f"service '{port.full_name}'"
        self.service_type: Any = interface_class(port.interface.value)
        self._reactions: dict[Event, RunningReaction] = {}
        traced = core.statistics.callback(port.kind.value, self._name)
        self._run = CallbackTimer(core, traced, port.budget_ms).around(self._carry_out)
        self._client = core.node.create_client(
            self.service_type,
            port.full_name,
            qos_profile=rclpy_profile(port.qos.profile),
            callback_group=core.group,
        )
        core.loop.add_client(self._client)

    @property
    def content_type(self) -> Any:
        """The class of requests."""
        return self.service_type.Request

    def react(self, event: Event, reaction: RunningReaction) -> None:
        """Run ``reaction`` on every response or failure of the port."""
        self._reactions[event] = reaction

    def call(self, request: Any, *, timeout_ms: float | None = None) -> Future[Any]:
        """Send ``request`` now; the future is the response.

        It ends with ServerUnavailable, CallTimeout or CallCancelled. Raises TypeError.
        """
        if not isinstance(request, self.content_type):
            raise TypeError(
                f"client '{self._name}' takes a {self.service_type.__name__}.Request, "
                f"not {type(request).__name__}"
            )
        limit_ms = self._timeout_ms if timeout_ms is None else timeout_ms
        server = self._find_server()
        if server is None or self._reactions:
            called = self._core.spawn(self._call(request, limit_ms))
            return wrap_future(called, self._take_failure)
        return self._call_at_once(server, request, limit_ms)

    def send(self, content: Any) -> None:
        """Send a request for a reaction; failures without ``on_failure`` are logged."""
        self._core.spawn(self._send(content))

    def activate(self) -> None:
        """Do nothing: calls get out as soon as the gate is open."""

    def deactivate(self) -> None:
        """Do nothing: the gate ends the calls that wait."""

    def destroy(self) -> None:
        """Leave."""
        self._core.loop.remove(self._client)
        self._core.node.destroy_client(self._client)

    def _call_at_once(self, server: Server, request: Any, timeout_ms: float) -> Future[Any]:
        """Call a server of the process: only the answer is waited for, which needs no task."""
        answer: Future[Any] = Future(self._take_failure)
        try:
            waiting = Waiting(self._core, self._what, timeout_ms)
        except CallCancelled as error:
            answer.set_exception(error)
            return answer
        self._core.statistics.calls += 1
        server.ask(request, waiting.hold(answer))
        return answer

    async def _call(self, request: Any, timeout_ms: float) -> Any:
        try:
            waiting = Waiting(self._core, self._what, timeout_ms)
            await waiting.until_there(self._has_server)
            self._core.statistics.calls += 1
            response = await waiting.until_done(self._ask(request))
        except CallError as error:
            self._react(Event.FAILURE, failure=str(error))
            raise
        self._react(Event.RESPONSE, response=response, request=request)
        return response

    def _has_server(self) -> bool:
        return self._find_server() is not None or self._client.service_is_ready()

    def _ask(self, request: Any) -> Any:
        """Send ``request``; the future response is one of ours or of rclpy's."""
        server = self._find_server()
        if server is not None:
            answer: Future[Any] = Future()
            server.ask(request, answer)
            return answer
        return self._client.call_async(request)

    async def _send(self, request: Any) -> None:
        try:
            await self._call(request, self._timeout_ms)
        except CallError as error:
            self._take_failure(error)

    def _take_failure(self, error: BaseException) -> None:
        """Tell of a failed call that nobody else looks after."""
        if isinstance(error, CallCancelled):
            self._core.log.debug(f"client '{self._name}': {error}")
        elif Event.FAILURE not in self._reactions:
            self._core.error_log.error(f"client '{self._name}'", str(error))

    def _react(self, event: Event, **values: Any) -> None:
        reaction = self._reactions.get(event)
        if reaction is None or not self._core.gate.incoming:
            return
        self._core.strand.post(lambda: self._run((reaction, event, values)))

    def _carry_out(self, item: tuple[RunningReaction, Event, dict[str, Any]]) -> None:
        reaction, event, values = item
        try:
            reaction.run(**values)
        except Exception as error:
            self._core.error_log.exception(f"client '{self._name}' on_{event}", error)
