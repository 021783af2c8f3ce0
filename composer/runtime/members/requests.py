"""Requests for transitions of the nodes of another process, those of one moment together.

A plan moves many nodes at once. A request for each would take a second for some hundred nodes, and
most of them would be lost: a service keeps the last 10 that it has not taken yet.

A process that was killed is known for 20 s more, with its service. If that counted as ready, a
request might be sent before the service of the next process is discovered, and be lost.

DDS repeats lost packets, but a request or its response may be lost nevertheless: rmw drops a
response to a client that the service has not discovered yet, and a full queue the oldest request.
So a step without a result is requested again. The process recognizes it by its number, and never
runs it twice: see :mod:`composer.runtime.manager.member_service`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import field
from functools import partial
from itertools import count
from typing import Any
from uuid import uuid4

from rclpy.node import Node as RosNode

from composer.base.fast_dataclass import dataclass
from composer.runtime.executors.futures import Future
from composer.runtime.executors.loop import Loop
from composer.runtime.protocol.codec import ProtocolError
from composer.runtime.protocol.reports import SystemReport
from composer.runtime.protocol.requests import AskReportKey, ChangeStates, Step, StepResult
from composer.runtime.ros.graph import participant, servers_of
from composer.runtime.ros.service_requests import RequestService, read_answer, request_message

_MAX_STEPS = 500  # per request; a service takes a million characters
MAX_REQUESTS = 8
_POLL_S = 0.01
#: After this time, steps are requested again, then after twice as long each time.
AGAIN_AFTER_S = 3.0
#: How long to wait for the service of a process that has reported. With other middleware, ids may
#: differ between processes.
DISCOVERED_WITHIN_S = 3.0
#: After this time, it is reported that the service of a process cannot be used.
READY_WITHIN_S = 3.0
#: A response may be lost, and a killed process is known for 20 s more, with its service.
_KEY_AGAIN_S = 0.25


@dataclass(frozen=True, slots=True)
class RequestedStep:
    """A step, and the future of its result."""

    step: Step
    result: Future[StepResult] = field(default_factory=Future)


class MemberRequests:
    """The client of the service ``request`` of a process. Use it on ``loop``."""

    def __init__(
        self,
        ros: RosNode,
        loop: Loop,
        service: str,
        *,
        on_report_key: Callable[[str], None],
        on_problem: Callable[[str], None],
    ) -> None:
        """``on_report_key(key)`` receives the key that was asked for.

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
        self._has_problem = False  # that has been reported
        self._unready_s = 0.0  # since when the service cannot be used
        self._is_discovered = True  # the service of this participant
        self._awaited_until_s = 0.0
        self._is_polling = False
        self._on_report_key = on_report_key
        self._key_request: Any = None  # the last one
        self._key_asked_s = -_KEY_AGAIN_S
        self._on_problem = on_problem
        self._holds = 0
        self._unsent: list[RequestedStep] = []
        self._sent: dict[Any, Sequence[RequestedStep]] = {}
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

    def on_report(self, report: SystemReport) -> None:
        """Receive a report of the process."""
        if self._participant != report.participant:
            self._participant = report.participant
            self._is_discovered = self._has_problem = False
            self._awaited_until_s = self._clock.monotonic() + DISCOVERED_WITHIN_S
        self._seen = report.number
        if self._unsent:  # an exception may have ended the wait for the service
            self._send()

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

    def hold(self) -> None:
        """Collect requests until :meth:`release`. Thread-safe."""
        self._loop.call_soon(partial(self._change_holds, 1))

    def release(self) -> None:
        """Send what has been requested since :meth:`hold`. Thread-safe."""
        self._loop.call_soon(partial(self._change_holds, -1))

    def fail(self, error: Exception) -> None:
        """End all requests with an exception: the process has ended."""
        open_ = [*self._unsent, *(step for steps in self._sent.values() for step in steps)]
        for pending in self._sent:
            self._client.remove_pending_request(pending)
        self._unsent.clear()
        self._sent.clear()
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
        self._forget_canceled()
        while self._unsent and not self._holds and len(self._sent) < MAX_REQUESTS:
            if not self._is_ready():
                self._wait_for_service()
                return
            self._unready_s = 0.0
            steps, self._unsent = self._unsent[:_MAX_STEPS], self._unsent[_MAX_STEPS:]
            self._send_request(steps, AGAIN_AFTER_S)

    def _send_request(self, steps: Sequence[RequestedStep], again_after_s: float) -> None:
        request = ChangeStates(
            self._participant,
            self._sender,
            self._seen,
            tuple(step.step for step in steps),
            self.are_last,
        )
        pending = self._client.call_async(request_message(request))
        self._sent[pending] = steps
        pending.add_done_callback(self._on_response)
        self._loop.call_later(again_after_s, partial(self._send_again, pending, 2 * again_after_s))

    def _send_again(self, pending: Any, again_after_s: float) -> None:
        """Request the steps again that have no results yet; the process knows their numbers."""
        steps = self._sent.get(pending, ())
        left = [step for step in steps if not step.result.done()]
        if left:
            del self._sent[pending]
            self._client.remove_pending_request(pending)
            self._send_request(left, again_after_s)

    def _wait_for_service(self) -> None:
        now_s = self._clock.monotonic()
        self._unready_s = self._unready_s or now_s
        if now_s - self._unready_s >= READY_WITHIN_S and not self._has_problem:
            self._has_problem = True
            self._on_problem("reports, but its service is not discovered; requests wait")
        if not self._is_polling:
            self._is_polling = True
            self._loop.call_later(_POLL_S, self._poll)

    def _poll(self) -> None:
        self._is_polling = False
        self._send()

    def _is_ready(self) -> bool:
        """Return whether the service is there, and belongs to the process that has reported."""
        if not self._client.service_is_ready():
            return False
        if not self._is_discovered:
            found = {participant(server).hex() for server in servers_of(self._ros, self._service)}
            is_found = self._participant in found
            self._is_discovered = is_found or self._clock.monotonic() >= self._awaited_until_s
        return self._is_discovered

    def _on_result(self, result: Future[StepResult]) -> None:
        if result.cancelled():
            self._loop.call_soon(self._send)

    def _forget_canceled(self) -> None:
        """Forget steps that nothing waits for any more: their responses may have been lost."""
        self._unsent = [step for step in self._unsent if not step.result.done()]
        for pending, sent in tuple(self._sent.items()):
            if all(step.result.done() for step in sent):
                del self._sent[pending]
                self._client.remove_pending_request(pending)

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
            results = read_answer(pending.result(), ChangeStates).results
        except ProtocolError as error:
            refusal = f"refused: {error}"
        for step, result in zip(sent, results, strict=False):
            step.result.set_result(result)
        for step in sent:  # without a result, the request was refused as a whole
            step.result.set_result(StepResult(success=False, reason=refusal))
        self._send()
