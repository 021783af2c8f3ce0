"""Requests for transitions of the nodes of another process, those of one moment together.

A plan moves many nodes at once. A request for each would take a second for some hundred nodes, and
most of them would be lost: a service keeps the last 10 that it has not taken yet.

A process that was killed is known for 20 s more, with its service. If that counted as ready, a
request might be sent before the service of the next process is discovered, and be lost.

Steps without a result are requested again: see :mod:`.requested_steps`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from itertools import count
from typing import Any
from uuid import uuid4

from rclpy.node import Node as RosNode

from composer.plan import SystemGoals
from composer.runtime.executors.futures import Future
from composer.runtime.executors.loop import Loop
from composer.runtime.members.requested_steps import AGAIN_AFTER_S, MemberRequest, RequestedStep
from composer.runtime.protocol.codec import ProtocolError
from composer.runtime.protocol.reports import SystemReport, TimingReport
from composer.runtime.protocol.requests import (
    AskReportKey,
    ChangeStates,
    KeepGoals,
    Step,
    StepResult,
)
from composer.runtime.ros.manager_interface import RequestService, read_answer, request_message
from composer.runtime.ros_graph.graph import participant, servers_of

_MAX_STEPS = 500  # per request; a service takes a million characters
_MAX_REQUESTS = 8
_POLL_S = 0.01
#: A request without steps is answered at once, unless it or its response is lost: rmw drops a
#: response if it has not discovered the client yet.
_ANSWERED_WITHIN_S = 5.0
#: How long to wait for the service of a process that has reported. With other middleware, ids may
#: differ between processes.
_DISCOVERED_WITHIN_S = 3.0
#: After this time, it is reported that the service of a process cannot be used.
_READY_WITHIN_S = 3.0
#: A response may be lost, and a killed process is known for 20 s more, with its service.
_KEY_AGAIN_S = 0.25


class MemberRequests:
    """The client of the service ``request`` of a process. Use it on ``loop``."""

    def __init__(  # noqa: PLR0913 - three of them are callbacks
        self,
        ros: RosNode,
        loop: Loop,
        service: str,
        *,
        on_timings: Callable[[TimingReport], None],
        on_report_key: Callable[[str], None],
        on_problem: Callable[[str], None],
    ) -> None:
        """``on_timings(report)`` receives the timings that were requested.

        ``on_report_key(key)`` receives the key that was asked for.
        ``on_problem(text)`` receives why the process does not get requests, once for each process.
        """
        self._ros = ros
        self._loop = loop
        self._clock = loop.clock
        self._service = service
        self._client = ros.create_client(RequestService, service)
        self._sender = uuid4().hex
        self._numbers = count(1)  # of steps
        self._participant = ""  # that of the process, once it has reported
        self._seen = 0  # the number of its last report
        self._received = 0  # the number of the last step that it has received
        self._has_problem = False  # that has been reported
        self._unready_s = 0.0  # since when the service cannot be used
        self._is_discovered = True  # the service of this participant
        self._awaited_until_s = 0.0
        self._is_polling = False
        self._on_timings = on_timings
        self._on_report_key = on_report_key
        self._key_request: Any = None  # the last one
        self._key_asked_s = -_KEY_AGAIN_S
        self._on_problem = on_problem
        self._holds = 0
        self._unsent: list[RequestedStep] = []
        self._unsent_goals: SystemGoals | None = None
        self._wants_timings = False
        self._sent: dict[Any, MemberRequest] = {}
        #: Whether the process ends after the next requests.
        self.are_last = False
        loop.add_client(self._client)

    def request(self, node: str, transition: str, after: Sequence[str] = ()) -> Future[StepResult]:
        """Request a transition; return the future of its result, which may be canceled.

        It begins after the transitions of the nodes ``after`` that were requested before.
        """
        step = RequestedStep(Step(next(self._numbers), transition, node, tuple(after)))
        step.result.add_done_callback(self._on_result)
        self._unsent.append(step)
        if len(self._unsent) == 1:  # otherwise, sending is due already
            self._loop.call_soon(self._send)
        return step.result

    def on_report(self, report: SystemReport, goals: SystemGoals | None) -> None:
        """Receive a report of the process, and the goals that it has to keep, if any."""
        if self._participant != report.participant:
            self._participant = report.participant
            self._is_discovered = self._has_problem = False
            self._awaited_until_s = self._clock.monotonic() + _DISCOVERED_WITHIN_S
        self._seen, self._received = report.number, report.received(self._sender)
        if goals is not None:
            self.keep(goals)
        if self._unsent:  # an exception may have ended the wait for the service
            self._send()

    def keep(self, goals: SystemGoals) -> None:
        """Request that the process keeps the goals of the system.

        It may be lost: reports say which goals the process keeps.
        """
        on_their_way = (self._unsent_goals, *(sent.goals for sent in self._sent.values()))
        if goals not in on_their_way:
            self._unsent_goals = goals
            self._loop.call_soon(self._send)

    def ask_for_timings(self) -> None:
        """Request the timings of the callbacks and chains of the process."""
        self._wants_timings = True
        self._loop.call_soon(self._send)

    def ask_for_report_key(self) -> None:
        """Ask the process for the key of its reports, unless that was done a moment ago."""
        now_s = self._clock.monotonic()
        if now_s - self._key_asked_s < _KEY_AGAIN_S or not self._client.service_is_ready():
            return
        self._key_asked_s = now_s
        if self._key_request is not None:
            self._client.remove_pending_request(self._key_request)
        request = request_message(AskReportKey())
        self._key_request = pending = self._client.call_async(request)
        pending.add_done_callback(self._on_key)

    @property
    def has_messages(self) -> bool:
        """Whether goals of the system, or a request for timings, are on their way. Thread-safe."""
        is_unsent = self._unsent_goals is not None or self._wants_timings
        return is_unsent or any(sent.goals or sent.timings for sent in tuple(self._sent.values()))

    def hold(self) -> None:
        """Collect requests until :meth:`release`. Thread-safe."""
        self._loop.call_soon(partial(self._change_holds, 1))

    def release(self) -> None:
        """Send what has been requested since :meth:`hold`. Thread-safe."""
        self._loop.call_soon(partial(self._change_holds, -1))

    def fail(self, error: Exception) -> None:
        """End all requests with an exception: the process has ended."""
        open_ = [*self._unsent, *(step for sent in self._sent.values() for step in sent.steps)]
        for pending in self._sent:
            self._client.remove_pending_request(pending)
        self._unsent.clear()
        self._sent.clear()
        self._unsent_goals, self._wants_timings = None, False
        for step in open_:
            step.result.set_exception(error)

    def close(self) -> None:
        """Destroy the client."""
        self._loop.remove(self._client)
        self._ros.destroy_client(self._client)

    def _change_holds(self, change: int) -> None:
        self._holds += change
        self._send()

    def _send(self) -> None:
        while (
            (self._unsent or self._unsent_goals or self._wants_timings)
            and not self._holds
            and len(self._sent) < _MAX_REQUESTS
        ):
            if not self._is_ready():
                self._wait_for_service()
                return
            self._unready_s = 0.0
            self._send_request(self._next())

    def _send_request(self, request: MemberRequest) -> None:
        pending = self._client.call_async(request_message(self._document(request)))
        self._sent[pending] = request
        pending.add_done_callback(self._on_response)
        if request.steps:
            self._loop.call_later(request.again_after_s, partial(self._send_again, pending))
        else:
            self._loop.call_later(_ANSWERED_WITHIN_S, partial(self._forget, pending))

    def _send_again(self, pending: Any) -> None:
        """Send a request again whose steps have no results yet; the process knows their numbers."""
        request = self._sent.get(pending)
        if request is None or not request.is_awaited:
            return
        del self._sent[pending]
        self._client.remove_pending_request(pending)
        again = request.again(self._seen)
        if request.is_lost(self._received, self._seen):
            self._report_problem(f"has not received '{again.steps[0].step}'; it is requested again")
        self._send_request(again)

    def _wait_for_service(self) -> None:
        now_s = self._clock.monotonic()
        self._unready_s = self._unready_s or now_s
        if now_s - self._unready_s >= _READY_WITHIN_S:
            self._report_problem("reports, but its service is not discovered; requests wait")
        if not self._is_polling:
            self._is_polling = True
            self._loop.call_later(_POLL_S, self._poll)

    def _poll(self) -> None:
        self._is_polling = False
        self._send()

    def _report_problem(self, text: str) -> None:
        if not self._has_problem:
            self._has_problem = True
            self._on_problem(text)

    def _is_ready(self) -> bool:
        """Return whether the service is there, and is that of the process that has reported."""
        if not self._client.service_is_ready():
            return False
        if not self._is_discovered:
            found = {participant(server).hex() for server in servers_of(self._ros, self._service)}
            is_found = self._participant in found
            self._is_discovered = is_found or self._clock.monotonic() >= self._awaited_until_s
        return self._is_discovered

    def _next(self) -> MemberRequest:
        """Return the next request: a message, which is answered at once, or steps."""
        if self._unsent_goals or self._wants_timings:
            message = MemberRequest(goals=self._unsent_goals, timings=self._wants_timings)
            self._unsent_goals, self._wants_timings = None, False
            return message
        steps, self._unsent = self._unsent[:_MAX_STEPS], self._unsent[_MAX_STEPS:]
        return MemberRequest(steps, again_after_s=AGAIN_AFTER_S, seen=self._seen)

    def _forget(self, pending: Any) -> None:
        """Wait no longer for the response to a request."""
        if self._sent.pop(pending, None) is not None:
            self._client.remove_pending_request(pending)
            self._send()

    def _on_result(self, result: Future[StepResult]) -> None:
        if result.cancelled():
            self._loop.call_soon(self._forget_canceled)

    def _forget_canceled(self) -> None:
        """Forget steps that nothing waits for any more: their responses may have been lost."""
        self._unsent = [step for step in self._unsent if not step.result.done()]
        for pending, sent in tuple(self._sent.items()):
            if sent.steps and not sent.is_awaited:
                self._forget(pending)

    def _document(self, request: MemberRequest) -> ChangeStates | KeepGoals:
        if not request.steps:
            return KeepGoals(self._participant, request.goals, request.timings)
        steps = tuple(step.step for step in request.steps)
        return ChangeStates(self._participant, self._sender, self._seen, steps, self.are_last)

    def _on_key(self, pending: Any) -> None:
        if pending is self._key_request:
            self._key_request = None
            with suppress(ProtocolError):
                self._on_report_key(read_answer(pending.result(), AskReportKey()).key)

    def _on_response(self, pending: Any) -> None:
        sent = self._sent.pop(pending, None)
        if sent is None:
            return
        results: Sequence[StepResult] = ()
        refusal = "refused"
        try:
            answer = read_answer(pending.result(), self._document(sent))
            if not isinstance(answer, TimingReport):
                results = answer.results
            elif sent.timings:  # else it is empty: the request has only brought goals
                self._on_timings(answer)
        except ProtocolError as error:
            refusal = f"refused: {error}"
        for step, result in zip(sent.steps, results, strict=False):
            step.result.set_result(result)
        for step in sent.steps:  # without a result, the request was refused as a whole
            step.result.set_result(StepResult(success=False, reason=refusal))
        self._send()
