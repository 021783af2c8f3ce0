"""Requests for transitions of the nodes of another process, those of one moment together.

A plan moves many nodes at once. A request for each would take a second for some hundred nodes, and
most of them would be lost: a service keeps the last 10 that it has not taken yet.

A process that was killed is known for 20 s more, with its service. If that counted as ready, a
request might be sent before the service of the next process is discovered, and be lost.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from time import monotonic
from typing import Any

from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue, SetParametersResult
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node as RosNode

from composer.runtime.executors.futures import Future
from composer.runtime.executors.loop import Loop
from composer.runtime.ros.graph import participant, servers_of
from composer.runtime.ros.manager_protocol import FIGURES, GOALS, LAST_STEPS, PARTICIPANT, STEPS

_MAX_STEPS = 500  # per request; a service takes up to 1000
_MAX_REQUESTS = 8
_POLL_S = 0.01
#: A request without steps is answered at once, unless it or its response is lost: rmw drops a
#: response if it has not discovered the client yet.
_ANSWERED_WITHIN_S = 5.0
#: How long to wait for the service of a process that has reported. With other middleware, ids may
#: differ between processes.
_DISCOVERED_WITHIN_S = 3.0


@dataclass(frozen=True, slots=True)
class _Wanted:
    step: str
    result: Future[SetParametersResult] = field(default_factory=Future)


@dataclass(frozen=True, slots=True)
class _Sent:
    """A request on its way: steps, or goals of the system and whether it asks for figures."""

    batch: Sequence[_Wanted]
    goals: str = ""
    figures: bool = False

    @property
    def is_awaited(self) -> bool:
        """Whether a result of a step is still waited for."""
        return any(not wanted.result.done() for wanted in self.batch)


class MemberRequests:
    """The client of the service ``change_states`` of a process. Use it on ``loop``."""

    def __init__(
        self, ros: RosNode, loop: Loop, service: str, on_figures: Callable[[str], None]
    ) -> None:
        """``on_figures(text)`` receives the timings that were requested."""
        self._ros = ros
        self._loop = loop
        self._service = service
        self._client = ros.create_client(SetParameters, service)
        self._participant = ""  # that of the process, once it has reported
        self._is_discovered = True  # the service of this participant
        self._awaited_until_s = 0.0
        self._is_polling = False
        self._on_figures = on_figures
        self._holds = 0
        self._unsent: list[_Wanted] = []
        self._unsent_goals = ""
        self._wants_figures = False
        self._sent: dict[Any, _Sent] = {}
        #: Whether the process ends after the next requests.
        self.are_last = False
        loop.add_client(self._client)

    def request(
        self, node: str, transition: str, after: Sequence[str] = ()
    ) -> Future[SetParametersResult]:
        """Request a transition; return the future of its result, which may be canceled.

        It begins after the transitions of the nodes ``after`` that were requested before.
        """
        wanted = _Wanted(" ".join((transition, node, *after)))
        wanted.result.add_done_callback(self._on_result)
        self._unsent.append(wanted)
        if len(self._unsent) == 1:  # otherwise, sending is due already
            self._loop.call_soon(self._send)
        return wanted.result

    def on_report(self, participant_of_process: str, goals: str | None) -> None:
        """Receive which participant has reported, and the goals that it has to keep, if any."""
        if self._participant != participant_of_process:
            self._participant = participant_of_process
            self._is_discovered = False
            self._awaited_until_s = monotonic() + _DISCOVERED_WITHIN_S
        if goals is not None:
            self.keep(goals)

    def keep(self, goals: str) -> None:
        """Request that the process keeps the goals of the system.

        It may be lost: reports say which goals the process keeps.
        """
        on_their_way = (self._unsent_goals, *(sent.goals for sent in self._sent.values()))
        if goals not in on_their_way:
            self._unsent_goals = goals
            self._loop.call_soon(self._send)

    def ask_for_figures(self) -> None:
        """Request the timings of the callbacks and chains of the process."""
        self._wants_figures = True
        self._loop.call_soon(self._send)

    @property
    def has_messages(self) -> bool:
        """Whether goals of the system, or a request for timings, are on their way. Thread-safe."""
        is_unsent = bool(self._unsent_goals) or self._wants_figures
        return is_unsent or any(sent.goals or sent.figures for sent in tuple(self._sent.values()))

    def hold(self) -> None:
        """Collect requests until :meth:`release`. Thread-safe."""
        self._loop.call_soon(partial(self._change_holds, 1))

    def release(self) -> None:
        """Send what has been requested since :meth:`hold`. Thread-safe."""
        self._loop.call_soon(partial(self._change_holds, -1))

    def fail(self, error: Exception) -> None:
        """End all requests with an exception: the process has ended."""
        open_ = [*self._unsent, *(wanted for sent in self._sent.values() for wanted in sent.batch)]
        for pending in self._sent:
            self._client.remove_pending_request(pending)
        self._unsent.clear()
        self._sent.clear()
        self._unsent_goals, self._wants_figures = "", False
        for wanted in open_:
            wanted.result.set_exception(error)

    def close(self) -> None:
        """Destroy the client."""
        self._loop.remove(self._client)
        self._ros.destroy_client(self._client)

    def _change_holds(self, change: int) -> None:
        self._holds += change
        self._send()

    def _send(self) -> None:
        while (
            (self._unsent or self._unsent_goals or self._wants_figures)
            and not self._holds
            and len(self._sent) < _MAX_REQUESTS
        ):
            if not self._is_ready():
                if not self._is_polling:
                    self._is_polling = True
                    self._loop.call_later(_POLL_S, self._poll)
                return
            sent = self._next()
            pending = self._client.call_async(self._message(sent))
            self._sent[pending] = sent
            pending.add_done_callback(self._on_response)
            if not sent.batch:
                self._loop.call_later(_ANSWERED_WITHIN_S, partial(self._forget, pending))

    def _poll(self) -> None:
        self._is_polling = False
        self._send()

    def _is_ready(self) -> bool:
        """Return whether the service is there, and is that of the process that has reported."""
        if not self._client.service_is_ready():
            return False
        if not self._is_discovered:
            found = {participant(server).hex() for server in servers_of(self._ros, self._service)}
            is_found = self._participant in found
            self._is_discovered = is_found or monotonic() >= self._awaited_until_s
        return self._is_discovered

    def _next(self) -> _Sent:
        """Return the next request: a message, which is answered at once, or steps."""
        if self._unsent_goals or self._wants_figures:
            sent = _Sent((), self._unsent_goals, self._wants_figures)
            self._unsent_goals, self._wants_figures = "", False
            return sent
        batch, self._unsent = self._unsent[:_MAX_STEPS], self._unsent[_MAX_STEPS:]
        return _Sent(batch)

    def _forget(self, pending: Any) -> None:
        """Wait no longer for the response to a request."""
        if self._sent.pop(pending, None) is not None:
            self._client.remove_pending_request(pending)
            self._send()

    def _on_result(self, result: Future[SetParametersResult]) -> None:
        if result.cancelled():
            self._loop.call_soon(self._forget_canceled)

    def _forget_canceled(self) -> None:
        """Forget steps that nothing waits for any more: their responses may have been lost."""
        self._unsent = [wanted for wanted in self._unsent if not wanted.result.done()]
        for pending, sent in tuple(self._sent.items()):
            if sent.batch and not sent.is_awaited:
                self._forget(pending)

    def _message(self, sent: _Sent) -> SetParameters.Request:
        value = ParameterValue(
            type=ParameterType.PARAMETER_STRING_ARRAY,
            string_array_value=[wanted.step for wanted in sent.batch],
        )
        name = LAST_STEPS if self.are_last else STEPS
        parameters = [Parameter(name=name, value=value)]
        for key, text in ((PARTICIPANT, self._participant), (GOALS, sent.goals)):
            if text:
                string = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=text)
                parameters.append(Parameter(name=key, value=string))
        if sent.figures:
            yes = ParameterValue(type=ParameterType.PARAMETER_BOOL, bool_value=True)
            parameters.append(Parameter(name=FIGURES, value=yes))
        return SetParameters.Request(parameters=parameters)

    def _on_response(self, pending: Any) -> None:
        sent = self._sent.pop(pending, None)
        if sent is None:
            return
        results = pending.result().results
        for wanted, result in zip(sent.batch, results, strict=False):
            wanted.result.set_result(result)
        for wanted in sent.batch:  # without a result, the request was refused as a whole
            wanted.result.set_result(SetParametersResult(successful=False, reason="refused"))
        if sent.figures and results:
            self._on_figures(results[-1].reason)
        self._send()
