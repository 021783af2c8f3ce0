"""A node in another process of the system."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from composer.model import Node
from composer.model.lifecycle import (
    ACTIVE,
    FINALIZED,
    INACTIVE,
    PRIMARY_STATES,
    TRANSITIONS,
    UNCONFIGURED,
    last_transition,
)
from composer.plan import Condition
from composer.runtime.executors.futures import Future
from composer.runtime.executors.tasks import wait_for
from composer.runtime.members.lives import NodeFigures, ProcessUnavailable
from composer.runtime.members.process import STARTS_WITHIN_S, MemberProcess
from composer.runtime.node.managed_node import TransitionOutcome
from composer.runtime.outside_nodes.outside_node import (
    OutsideContext,
    OutsideNode,
    TransitionRefused,
)
from composer.runtime.outside_nodes.remote_node import DONE_IN
from composer.runtime.protocol.reports import NodeReport
from composer.runtime.protocol.requests import CREATE, StepResult

#: A report follows a successful response soon; each second there is one in any case.
REPORTED_WITHIN_S = 2.0


class MemberNode(OutsideNode):
    """The :class:`.ManagedNode` of a node in another process of the system.

    Its process starts with its first transition. What it reports by itself is a requested
    transition, or a failure that its process has handled by taking it down.
    """

    def __init__(self, model: Node, process: MemberProcess, context: OutsideContext) -> None:
        super().__init__(model, context)
        self._process = process
        self._reported = ""  # the last primary state
        self._is_moving = False  # according to the last report
        self._awaited: tuple[str, Future[None]] | None = None  # the goal of a transition
        self._has_failed = False
        self._has_finished = False
        self._late_from_s = math.inf  # when it should have begun to move, by the clock of the loop
        self._late_reports = 0  # since then
        #: Its figures over all lives of its process.
        self.all_figures = NodeFigures()
        self._given_up: set[str] = set()  # goals of requests that may still arrive after a cut
        process.add(self)

    @property
    def transition_timeout_s(self) -> float:
        """How long a transition may take, including the start of the process."""
        return self._timeout_s + STARTS_WITHIN_S + REPORTED_WITHIN_S

    @property
    def pid(self) -> int | None:
        """The id of its process, if that was started here."""
        return self._process.pid

    @property
    def figures(self) -> Mapping[str, Any]:
        """What the process reports of the node, by the names of the fields of ``NodeReport``."""
        return self.all_figures.current

    def count(self, counter: str) -> int:
        """Return a counter of the node since this process knows it."""
        return self.all_figures.since_start.get(counter, 0)

    @property
    def is_absent(self) -> bool:
        """Whether its process is awaited, because something else starts it."""
        return self._process.is_absent

    @property
    def has_finished(self) -> bool:
        """Whether its process reports that its program has ended itself, with exit status 0."""
        return self._has_finished

    def destroy(self) -> None:
        """Do nothing: the node belongs to its process."""

    async def create_again(self, is_outdated: Callable[[], bool]) -> str | None:
        """Let its process create it again if it is finalized; return why that failed, or None.

        Without its process, there is no node, and the next process creates it.
        """
        await self._lock.acquire()
        try:
            if self._state != FINALIZED or is_outdated():
                return None
            if self._reported == FINALIZED:
                try:
                    problem = await self._request_creation()
                except ProcessUnavailable as error:
                    problem = str(error) if self._reported == FINALIZED else ""
                if problem:
                    return f"cannot be created again: {problem}"
            self._reported = self._state = UNCONFIGURED
            self._is_moving = self._has_failed = False
            return None
        finally:
            self._lock.release()

    async def _request_creation(self) -> str:
        """Return why the process cannot create the node again; empty if it has.

        Raises ProcessUnavailable.
        """
        result = self._process.request(self.full_name, CREATE)
        try:
            await self._wait_for(result)
        finally:
            result.cancel()
        response = result.result()
        return "" if response.success else response.reason

    async def _work(self, transition: str) -> None:
        try:
            if transition == "configure":
                await self._prepare()
            await self._request(transition)
        except ProcessUnavailable as error:
            self._is_lost = True
            if transition in ("cleanup", "shutdown"):
                return  # without its process, the node is down
            raise TransitionRefused(str(error), UNCONFIGURED) from error

    async def _prepare(self) -> None:
        """Make sure that the process runs, and that the node can be configured."""
        await self._process.ensure()
        if self._has_failed:
            if not await self._is_taken_down():
                await self._process.kill(f"{self.full_name} hangs")
            await self._process.ensure()

    async def _is_taken_down(self) -> bool:
        """Wait until reports say that its process has taken the failed node down.

        A node hangs that does not begin to move, or moves for longer than a transition may take. If
        reports are missing, the whole process may hang, or this computer was busy: it is lost then,
        see :class:`.MemberProcess`.
        """
        now_s = self.loop.clock.monotonic()
        self._late_from_s, self._late_reports = now_s + REPORTED_WITHIN_S, 0
        await self._until(
            # The first late report may be older, and have waited in this process.
            lambda: self._is_down() or self._is_moving or self._late_reports > 1,
            now_s + STARTS_WITHIN_S,
        )
        left_s = self._timeout_s if self._is_moving else 0.0
        return await self._until(self._is_down, self.loop.clock.monotonic() + left_s)

    def _is_down(self) -> bool:
        return not self._is_moving and self._reported not in (INACTIVE, ACTIVE)

    async def _request(self, transition: str) -> None:
        if self._process.pid is None:
            if self._run_state.leaves_others:
                return
            if transition == "shutdown":
                await self._follow_end()
                return  # a process that was not started here may be used again
        if self._reported in DONE_IN[transition]:
            return
        goal, reported = TRANSITIONS[transition].goal, Future[None]()
        self._awaited = goal, reported
        try:
            result = self._process.request(self.full_name, transition, self._after)
            self._after = ()
            try:
                await self._finish(result, reported)
            except ProcessUnavailable:
                self._given_up.add(goal)
                raise
            finally:
                result.cancel()  # nothing waits for it any more
        finally:
            self._awaited = None
        self._reported, self._is_moving = goal, False
        self._given_up.clear()  # requests arrive in order

    async def _finish(self, result: Future[StepResult], reported: Future[None]) -> None:
        """Wait for the end of a transition: a report, or a response, perhaps that of many nodes."""
        either: Future[None] = Future()
        for future in (result, reported):
            future.add_done_callback(lambda _: either.set_result(None))
        await self._wait_for(either)
        if reported.done():
            return
        response = result.result()
        if not response.success:
            raise TransitionRefused(response.reason, self._reported or UNCONFIGURED)
        if self._awaited == (FINALIZED, reported):
            await self._wait_for_counters(reported)

    async def _follow_end(self) -> None:
        """Wait for the report that follows the last transition here, if it is missing."""
        if self._reported != UNCONFIGURED or not self._process.is_report_due(self.full_name):
            return
        reported = Future[None]()
        self._awaited = UNCONFIGURED, reported
        try:
            await self._wait_for_counters(reported)
        finally:
            self._awaited = None

    async def _wait_for_counters(self, reported: Future[None]) -> None:
        """Wait for the last report, with the final counters; the node is down without it, too."""
        end_s = self._run_state.end_s
        left_s = math.inf if end_s is None else end_s - self.loop.clock.monotonic()
        wait_s = min(REPORTED_WITHIN_S, left_s / 2.0)
        await wait_for(self.loop, reported, max(0.0, wait_s))

    async def _wait_for(self, future: Future[Any]) -> None:
        """Wait while nodes of the process move: this one may have to wait for others.

        Raises ProcessUnavailable.
        """
        start_s = self.loop.clock.monotonic()
        while not future.done():
            start_s = max(start_s, self._process.moved_s)
            self.transition_started_s = start_s
            end_s = start_s + self._timeout_s
            if self._run_state.end_s is not None:
                end_s = min(end_s, self._run_state.end_s)
            if self.loop.clock.monotonic() >= end_s:
                raise ProcessUnavailable(f"{self._process} does not respond")
            await wait_for(self.loop, future, end_s - self.loop.clock.monotonic())

    def _on_settled(self) -> None:
        if self._state == FINALIZED:
            self._process.end_if_done()

    def on_report(self, reported: NodeReport) -> None:
        """Follow the state of the node, by a report that includes all responses."""
        state, before = reported.state, self._reported
        is_primary = state in PRIMARY_STATES
        self._is_moving = not is_primary
        if is_primary:
            self._reported = state
        self._late_reports += self.loop.clock.monotonic() >= self._late_from_s
        if self._awaited is not None and self._awaited[0] == state:
            self._awaited[1].set_result(None)
        failed_now = bool(reported.held_down) and not self._has_failed
        self._has_failed = bool(reported.held_down)
        self._has_finished = reported.condition == Condition.FINISHED
        if self._lock.is_held:
            return
        has_moved = is_primary and state not in (self._state, before) and before == self._state
        if failed_now or (has_moved and self._has_failed):  # again, without a report in between
            self._fail(reported.held_down)  # its process takes it down
        elif has_moved and state in self._given_up:
            # Requested here before the process was lost, and not by a user: as after its return.
            self._given_up.clear()
            self._use_again()
            self._listener.on_returned()
        elif has_moved:
            self._follow(last_transition(self._state, state), state)

    def on_process_end(self, reason: str) -> None:
        """Report the end of the process as a failure of the node."""
        self._reported, self._is_moving, self._has_failed = "", False, False
        if not self._lock.is_held and self._state in (INACTIVE, ACTIVE):
            self._is_lost = True
            self._fail(reason, is_awaited=self.is_absent)

    def on_process_return(self) -> None:
        """Use the node again, in the state in which its process has kept it."""
        if not self._is_lost:
            return
        self._is_lost = False
        if not self._lock.is_held and self._reported in (INACTIVE, ACTIVE):
            self._use_again()
        self._listener.on_returned()

    def take_over(self) -> None:
        """Use the node in the state in which an earlier coordinating process has left it."""
        self._is_lost = True
        if self._process.is_absent:
            self._listener.on_ended(f"{self._process} does not run", is_awaited=True)
        else:
            self.on_process_return()

    def _use_again(self) -> None:
        """Use the node in the state in which its process reports it."""
        self._state = self._reported
        self._listener.on_transition_end(
            TransitionOutcome("return", self._state, success=True, requested=False)
        )
