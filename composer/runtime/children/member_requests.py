"""Requests for transitions of the nodes of another process, those of one moment together.

A plan moves many nodes at once. A request for each would take a second for some hundred nodes, and
most of them would be lost: a service keeps the last 10 that it has not taken yet.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue, SetParametersResult
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node as RosNode

from composer.runtime.executors.futures import Future
from composer.runtime.executors.loop import Loop
from composer.runtime.ros.manager_protocol import GOALS, LAST_STEPS, STEPS

_MAX_STEPS = 500  # per request; a service takes up to 1000
_MAX_REQUESTS = 8
_POLL_S = 0.01


@dataclass(frozen=True, slots=True)
class _Wanted:
    step: str
    result: Future[SetParametersResult] = field(default_factory=Future)


class MemberRequests:
    """The client of the service ``change_states`` of a process. Use it on ``loop``."""

    def __init__(self, ros: RosNode, loop: Loop, service: str) -> None:
        self._ros = ros
        self._loop = loop
        self._client = ros.create_client(SetParameters, service)
        self._holds = 0
        self._unsent: list[_Wanted] = []
        self._unsent_goals = ""
        self._sent: dict[Any, tuple[Sequence[_Wanted], str]] = {}  # with the goals of the system
        #: Whether the process ends after the next requests.
        self.are_last = False
        loop.add_client(self._client)

    def request(
        self, node: str, transition: str, after: Sequence[str] = ()
    ) -> Future[SetParametersResult]:
        """Request a transition; return the future of its result.

        It begins after the transitions of the nodes ``after`` that were requested before.
        """
        wanted = _Wanted(" ".join((transition, node, *after)))
        self._unsent.append(wanted)
        if len(self._unsent) == 1:  # otherwise, sending is due already
            self._loop.call_soon(self._send)
        return wanted.result

    def keep(self, goals: str) -> None:
        """Request that the process keeps the goals of the system.

        It may be lost: reports say which goals the process keeps.
        """
        if goals not in self._goals_on_their_way:
            self._unsent_goals = goals
            self._loop.call_soon(self._send)

    @property
    def has_goals(self) -> bool:
        """Whether goals of the system are on their way."""
        return any(self._goals_on_their_way)

    @property
    def _goals_on_their_way(self) -> Sequence[str]:
        return self._unsent_goals, *(goals for _, goals in tuple(self._sent.values()))

    def hold(self) -> None:
        """Collect requests until :meth:`release`. Thread-safe."""
        self._loop.call_soon(partial(self._change_holds, 1))

    def release(self) -> None:
        """Send what has been requested since :meth:`hold`. Thread-safe."""
        self._loop.call_soon(partial(self._change_holds, -1))

    def fail(self, error: Exception) -> None:
        """End all requests with an exception: the process has ended."""
        open_ = [*self._unsent, *(wanted for batch, _ in self._sent.values() for wanted in batch)]
        for pending in self._sent:
            self._client.remove_pending_request(pending)
        self._unsent.clear()
        self._sent.clear()
        self._unsent_goals = ""
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
            (self._unsent or self._unsent_goals)
            and not self._holds
            and len(self._sent) < _MAX_REQUESTS
        ):
            if not self._client.service_is_ready():
                if self._unsent:
                    self._loop.call_later(_POLL_S, self._send)
                return
            batch, self._unsent = self._unsent[:_MAX_STEPS], self._unsent[_MAX_STEPS:]
            goals, self._unsent_goals = self._unsent_goals, ""
            pending = self._client.call_async(self._message(batch, goals))
            self._sent[pending] = batch, goals
            pending.add_done_callback(partial(self._on_response, batch))

    def _message(self, batch: Sequence[_Wanted], goals: str) -> SetParameters.Request:
        value = ParameterValue(
            type=ParameterType.PARAMETER_STRING_ARRAY,
            string_array_value=[wanted.step for wanted in batch],
        )
        name = LAST_STEPS if self.are_last else STEPS
        parameters = [Parameter(name=name, value=value)]
        if goals:
            text = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=goals)
            parameters.append(Parameter(name=GOALS, value=text))
        return SetParameters.Request(parameters=parameters)

    def _on_response(self, batch: Sequence[_Wanted], pending: Any) -> None:
        if self._sent.pop(pending, None) is None:
            return
        for wanted, result in zip(batch, pending.result().results, strict=False):
            wanted.result.set_result(result)
        for wanted in batch:  # without a result, the request was refused as a whole
            wanted.result.set_result(SetParametersResult(successful=False, reason="refused"))
        self._send()
