"""The service by which the coordinating process of a system moves the nodes of another one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node

from composer.runtime.children.remote_lifecycle import DONE_IN
from composer.runtime.executors.event_loop import EventLoop
from composer.runtime.executors.futures import Cancelled, Future
from composer.runtime.executors.loop import Reply, unused_callback
from composer.runtime.manager.proxy_services import Nodes
from composer.runtime.node.managed_node import ManagedNode
from composer.runtime.node.outcome import FINALIZED, TransitionOutcome
from composer.runtime.ros.limited_requests import TooLarge, limited
from composer.runtime.ros.manager_protocol import (
    CHANGE_STATES,
    CREATE,
    FIGURES,
    GOALS,
    LAST_STEPS,
    PARTICIPANT,
)

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
    timings of callbacks and chains as text.
    """

    nodes: Nodes
    recreate: Callable[[ManagedNode], str | None]
    report_number: Callable[[], int]
    publish_states: Callable[[], None]
    expect_end: Callable[[], None]
    keep_goals: Callable[[str], None]
    figures: Callable[[], str]


class MemberService:
    """The service ``change_states``."""

    def __init__(
        self, node: Node, loop: EventLoop, callbacks: MemberCallbacks, participant: str
    ) -> None:
        """``participant`` is that of the process, as it reports it."""
        self._loop = loop
        self._callbacks = callbacks
        self._participant = participant
        self._running: dict[str, Future[TransitionOutcome]] = {}  # by node, the last one requested
        service = node.create_service(limited(SetParameters), f"~/{CHANGE_STATES}", unused_callback)
        loop.add_service(service, self._on_request)

    def _on_request(self, request: Any, reply: Reply) -> None:
        if isinstance(request, TooLarge):
            reply(SetParameters.Response())
        elif self._is_meant(request):
            self._loop.run_task(self._change_states(request, reply))

    def _is_meant(self, request: Any) -> bool:
        """Return whether a request is not for another process of the same name."""
        meant = [item.value.string_value for item in request.parameters if item.name == PARTICIPANT]
        return meant in ([], [self._participant])

    async def _change_states(self, request: Any, reply: Reply) -> None:
        """Run all steps of a request, at the same time unless they wait for each other."""
        nodes = self._callbacks.nodes()
        steps: list[Sequence[str]] = []
        for parameter in request.parameters:
            if parameter.name == GOALS:
                self._callbacks.keep_goals(parameter.value.string_value)
            steps += [text.split() for text in parameter.value.string_array_value]
            if parameter.name == LAST_STEPS:
                self._callbacks.expect_end()
        changes = [self._start(step, nodes) for step in steps]
        response = SetParameters.Response()
        try:
            for change in changes:
                outcome = None if change is None else await change
                response.results.append(self._result(outcome))
            if any(parameter.name == FIGURES for parameter in request.parameters):
                text = self._callbacks.figures()
                response.results.append(SetParametersResult(successful=True, reason=text))
        finally:
            reply(response)
        if any(step[:1] == [_SHUTDOWN] for step in steps):
            self._callbacks.publish_states()

    def _start(
        self, step: Sequence[str], nodes: Mapping[str, ManagedNode]
    ) -> Future[TransitionOutcome] | None:
        transition, name, *after = step if len(step) > 1 else ("", "")
        node = nodes.get(name)
        if node is None:
            return None
        earlier = [self._running[other] for other in after if other in self._running]
        if earlier:
            change = self._loop.run_task(self._change_after(earlier, node, transition))
        else:
            change = node.loop.run_task(self._change(node, transition))
        self._running[name] = change
        change.add_done_callback(partial(self._forget, name))
        return change

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

    def _forget(self, name: str, change: Future[TransitionOutcome]) -> None:
        if self._running.get(name) is change:
            self._running.pop(name, None)

    def _result(self, outcome: TransitionOutcome | None) -> SetParametersResult:
        if outcome is None:
            return SetParametersResult(successful=False, reason="the process has no such node")
        reason = str(self._callbacks.report_number()) if outcome.success else outcome.reason
        return SetParametersResult(successful=outcome.success, reason=reason)
