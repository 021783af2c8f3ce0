"""The service by which the coordinating process of a system moves the nodes of another one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from itertools import zip_longest
from time import monotonic
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node

from composer.base.fast_dataclass import dataclass
from composer.runtime.executors.futures import Cancelled, Future
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.sources import Reply, unused_callback
from composer.runtime.manager.proxy_services import Nodes
from composer.runtime.manager.received_steps import ReceivedSteps, ReportTimes, StepId
from composer.runtime.metrics.repeat_limit import RepeatLimit
from composer.runtime.node.managed_node import FINALIZED, ManagedNode, TransitionOutcome
from composer.runtime.outside_nodes.remote_node import DONE_IN
from composer.runtime.ros.limited_requests import TooLarge, limited
from composer.runtime.ros.manager_protocol import (
    CHANGE_STATES,
    CREATE,
    FIGURES,
    GOALS,
    LAST_STEPS,
    NUMBERS,
    PARTICIPANT,
    REPORT_KEY,
    SEEN_REPORT,
    SENDER,
)

_MAX_LISTED = 3
_TRANSITIONS = (*DONE_IN, CREATE)
_CONFIGURE, _SHUTDOWN = "configure", "shutdown"


@dataclass(frozen=True, slots=True)
class MemberCallbacks:
    """What the service calls, on its loop.

    ``nodes()`` returns the nodes by their full names. ``recreate(node)``, called on the loop of the
    node, replaces it by a new one if it is finalized, and returns why it cannot be created, or
    None. ``report_number()`` returns the number of the last report of the states.
    ``publish_states()`` is called once nodes are shut down: the coordinating process waits for
    their last counters. ``expect_end()`` is called if the process ends after the steps of a
    request. ``keep_goals(text)`` receives the goals of the whole system. ``figures()`` returns the
    timings of callbacks and chains as text. ``report_key`` answers processes that ask for it,
    unless it is empty.
    """

    nodes: Nodes
    recreate: Callable[[ManagedNode], str | None]
    report_number: Callable[[], int]
    publish_states: Callable[[], None]
    expect_end: Callable[[], None]
    keep_goals: Callable[[str], None]
    figures: Callable[[], str]
    report_key: str


@dataclass(slots=True)
class _Step:
    """A step that runs, or has ended with ``result``."""

    change: Future[TransitionOutcome]
    result: SetParametersResult | None = None


class MemberService:
    """The service ``change_states``."""

    def __init__(
        self,
        node: Node,
        loop: Loop,
        callbacks: MemberCallbacks,
        participant: str,
        log: Callable[[str], None],
    ) -> None:
        """``participant`` is that of the process, as it reports it."""
        self._loop = loop
        self._callbacks = callbacks
        self._participant = participant
        self._log = log
        self._received = ReceivedSteps[_Step]()
        self._reports = ReportTimes()
        self._repeats = RepeatLimit()
        service = node.create_service(limited(SetParameters), f"~/{CHANGE_STATES}", unused_callback)
        loop.add_service(service, self._on_request)

    @property
    def reported(self) -> Mapping[str, str]:
        """What reports say for the coordinating process."""
        return {"participant": self._participant, "last_step": self._received.last_text}

    def on_report(self, number: int) -> None:
        """Receive that a report is the current one now."""
        self._reports.note(number, monotonic())

    def _on_request(self, request: Any, reply: Reply) -> None:
        if isinstance(request, TooLarge):
            reply(SetParameters.Response())
            return
        values = {item.name: item.value for item in request.parameters}
        if PARTICIPANT in values and values[PARTICIPANT].string_value != self._participant:
            return  # for another process of the same name
        if REPORT_KEY in values:
            self._answer_report_key(reply)
            return
        if GOALS in values:
            self._callbacks.keep_goals(values[GOALS].string_value)
        if self._is_outdated(values):
            self._log_late(values)
            return
        if LAST_STEPS in values:
            self._callbacks.expect_end()
        self._loop.run_task(self._change_states(values, reply))

    def _answer_report_key(self, reply: Reply) -> None:
        key = self._callbacks.report_key
        if key:
            result = SetParametersResult(successful=True, reason=key)
            reply(SetParameters.Response(results=[result]))

    def _is_outdated(self, values: Mapping[str, Any]) -> bool:
        seen = values.get(SEEN_REPORT)
        return seen is not None and self._reports.is_outdated(seen.integer_value, monotonic())

    def _log_late(self, values: Mapping[str, Any]) -> None:
        admission = self._repeats.admit("late")
        if admission is None:
            return
        nodes = self._callbacks.nodes()
        steps = [text.split()[:2] for text in _steps(values) if text.split()]
        known = [step for step in steps if step[0] in _TRANSITIONS and step[-1] in nodes]
        listed = ", ".join(" ".join(step) for step in known[:_MAX_LISTED])
        self._log(f"ignored a request that has arrived too late: {listed}{admission.suffix}")

    async def _change_states(self, values: Mapping[str, Any], reply: Reply) -> None:
        """Run all steps of a request, at the same time unless they wait for each other."""
        nodes = self._callbacks.nodes()
        texts = [text.split() for text in _steps(values)]
        steps = [
            self._start(text, step, nodes)
            for text, step in zip_longest(texts, _ids(values), fillvalue=None)
            if text is not None
        ]
        response = SetParameters.Response()
        try:
            for step in steps:
                response.results.append(await self._result(step))
            if FIGURES in values:
                text = self._callbacks.figures()
                response.results.append(SetParametersResult(successful=True, reason=text))
        finally:
            reply(response)
        if any(text[:1] == [_SHUTDOWN] for text in texts):
            self._callbacks.publish_states()

    def _start(
        self, text: Sequence[str], step: StepId | None, nodes: Mapping[str, ManagedNode]
    ) -> _Step | str:
        """Start a step unless it was received before; return it, or why it is not started."""
        transition, name, *after = text if len(text) > 1 else ("", "")
        node = nodes.get(name)
        if node is None:
            return "the process has no such node"
        known = self._received.find(name, step)
        if known is not None:
            return known
        if self._received.is_replaced(name, step):
            return "a later request was received before"
        earlier = [other.change for other in self._received.of(after) if not other.change.done()]
        if earlier:
            change = self._loop.run_task(self._change_after(earlier, node, transition))
        else:
            change = node.loop.run_task(self._change(node, transition))
        new = _Step(change)
        self._received.add(name, step, new)
        return new

    async def _change_after(
        self, earlier: Sequence[Future[TransitionOutcome]], node: ManagedNode, transition: str
    ) -> TransitionOutcome:
        """Run a transition once others have ended, whether they have succeeded or not."""
        for other in earlier:
            with suppress(Cancelled, Exception):
                await other
        return await node.loop.run_task(self._change(node, transition))

    async def _change(self, node: ManagedNode, transition: str) -> TransitionOutcome:
        """Run a transition, on the loop of the node; a finalized node is created again for it.

        The coordinating process configures one only to restart it, or to bring the system up.
        """
        if transition in (_CONFIGURE, CREATE) and node.state == FINALIZED:
            problem = self._callbacks.recreate(node)
            if problem is not None:
                return TransitionOutcome(transition, FINALIZED, success=False, reason=problem)
            node = self._callbacks.nodes()[node.full_name]
        if node.state in DONE_IN.get(transition, ()):  # by a request that was given up, perhaps
            return TransitionOutcome(transition, node.state, success=True)
        if transition == CREATE:
            return TransitionOutcome(transition, node.state, success=True)
        return await node.lifecycle.change(transition)

    async def _result(self, step: _Step | str) -> SetParametersResult:
        """Return the result of a step, which is the same if it is requested again."""
        if isinstance(step, str):
            return SetParametersResult(successful=False, reason=step)
        outcome = await step.change
        if step.result is None:
            number = str(self._callbacks.report_number())
            reason = number if outcome.success else outcome.reason
            step.result = SetParametersResult(successful=outcome.success, reason=reason)
        return step.result


def _steps(values: Mapping[str, Any]) -> list[str]:
    return [text for value in values.values() for text in value.string_array_value]


def _ids(values: Mapping[str, Any]) -> list[StepId]:
    """Return what identifies the steps of a request; nothing if it is of another version."""
    if SENDER not in values or NUMBERS not in values:
        return []
    sender = values[SENDER].string_value
    return [StepId(sender, number) for number in values[NUMBERS].integer_array_value]
