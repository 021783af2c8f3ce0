"""A process of the system that runs some of its nodes: started, observed, and asked to move them.

It is ``compose run SYSTEM --process NAME``, with a manager node of its own. The states of its nodes
are in its reports; requests for transitions go to the manager's service.

The process with the instance lock runs the nodes, whatever has started it. One that was not started
here is used as it is, and from then on only awaited: what has started it may start it again.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING

from composer.model import Process
from composer.model.lifecycle import ACTIVE, FINALIZED, INACTIVE, PRIMARY_STATES
from composer.runtime.children.child_processes import Child, StartFailed
from composer.runtime.children.output import attribute_line, process_loggers
from composer.runtime.executors.futures import Future
from composer.runtime.executors.tasks import sleep
from composer.runtime.executors.tracebacks import printable
from composer.runtime.members.lives import (
    REPORTS_WITHIN_S,
    MemberContext,
    MemberLife,
    MemberLives,
    MemberReports,
    ProcessUnavailable,
)
from composer.runtime.members.requests import MemberRequests
from composer.runtime.process.instance_lock import ALREADY_RUNS, is_held
from composer.runtime.protocol.reports import SystemReport
from composer.runtime.protocol.requests import NAME, REQUEST, StepResult

if TYPE_CHECKING:
    from composer.runtime.members.node import MemberNode

#: How long a process may take to import ROS, join the graph and report, on a busy machine.
STARTS_WITHIN_S = 30.0
_POLL_S = 0.01
#: How often to look whether another process holds the instance lock.
_LOCK_POLL_S = 0.1
_ENDS_WITHIN_S = 1.0
_KILLED_WITHIN_S = 0.5
_KEY_BYTES = 32


class MemberProcess:
    """One process of the system."""

    def __init__(self, process: Process, context: MemberContext) -> None:
        self._process = process
        self._context = context
        self._clock = context.loop.clock
        self._name = context.full_name(process)
        self._members: dict[str, MemberNode] = {}
        #: When, by the clock of the loop, it last reported that a node has moved.
        self.moved_s = 0.0
        self._lives = MemberLives(self._name, str(self), context, self._members, self._fail)
        self._starting: Future[None] | None = None
        self.requests = MemberRequests(
            context.manager,
            context.loop,
            f"{self._name}/{NAME}/{REQUEST}",
            on_report_key=lambda key: self._reports.on_key(key),  # noqa: PLW0108 - set below
            on_problem=self._lives.warn,
        )
        self._reports = MemberReports(
            self._name, context, self._lives, self.requests.ask_for_report_key, self._receive
        )

    def add(self, member: MemberNode) -> None:
        """Add a node."""
        self._members[member.full_name] = member

    @property
    def pid(self) -> int | None:
        """Its process id, if it was started here."""
        life = self._lives.current
        return None if life is None or life.child is None else life.child.pid

    @property
    def is_absent(self) -> bool:
        """Whether it does not run or report, and something else has to start it."""
        return not self._lives.may_start and self._lives.up is None

    @property
    def is_known(self) -> bool:
        """Whether there is nothing to wait for at the start: it does not run, or has reported.

        A node that still moves is to be waited for.
        """
        life = self._lives.current
        if life is None or life.last is None:
            has_child = life is not None and life.child is not None
            return has_child or (self._lives.may_start and not is_held(self._name))
        return all(node.state in PRIMARY_STATES for node in life.states.values())

    @property
    def is_running(self) -> bool:
        """Whether it certainly runs: it reports, or holds the instance lock on this computer."""
        return self._lives.up is not None or is_held(self._name)

    @property
    def has_kept_nodes(self) -> bool:
        """Whether it was not started here, and nodes of it are inactive or active."""
        life = self._lives.up
        states = {} if life is None or life.child is not None else life.states
        return any(node.state in (INACTIVE, ACTIVE) for node in states.values())

    @property
    def last_report(self) -> SystemReport | None:
        """Its last report. Once its end was requested, that includes timings."""
        return self._lives.last_report

    def is_report_due(self, node: str) -> bool:
        """Return whether the last report may be older than the last response about a node."""
        life = self._lives.current
        if life is None or life.last is None or life.lost:
            return False
        return life.last.number <= life.answered.get(node, -1)

    def start_soon(self) -> None:
        """Start the process unless it runs: all at once, not each with its first node."""

        async def start() -> None:
            with suppress(ProcessUnavailable):  # the first node that is configured reports it
                await self.ensure()

        self._context.loop.run_task(start())

    async def ensure(self) -> None:
        """Start the process unless it runs, and wait for its first report.

        Raises ProcessUnavailable.
        """
        while self._starting is not None:
            await self._starting
        if self._lives.up is not None:
            return
        self._starting = Future()
        try:
            await self._start()
        finally:
            starting, self._starting = self._starting, None
            starting.set_result(None)

    def request(self, node: str, transition: str, after: Sequence[str] = ()) -> Future[StepResult]:
        """Request a transition of a node, after requests for others; return its future result.

        Raises ProcessUnavailable if the process does not run; so does the future if it ends.
        """
        life = self._lives.current
        if life is None or not life.is_up:
            how = "does not run" if life is None else life.lost or "has not reported yet"
            raise ProcessUnavailable(f"{self} {how}")
        is_ending = self._context.run_state.end_s is not None
        self.requests.are_last = is_ending and self.pid is not None
        result = self.requests.request(node, transition, after)
        result.add_done_callback(partial(self._on_response, life, node))
        return result

    async def kill(self, reason: str) -> None:
        """End a process in which a node hangs; a failure of all its nodes.

        Raises ProcessUnavailable if it was not started here.
        """
        life = self._lives.current
        if life is None or life.child is None:
            raise ProcessUnavailable(f"{reason}, and {self} was not started here")
        await self._kill_child(life, life.child)

    def end(self) -> None:
        """End the process if it was started here, without waiting for that."""
        life = self._lives.current
        if life is not None and life.child is not None and not self._lives.is_ending:
            self._lives.is_ending = True
            self._context.children.end(life.child, _ENDS_WITHIN_S, _KILLED_WITHIN_S)

    def end_if_done(self) -> None:
        """End the process if all its nodes are shut down."""
        if all(member.state == FINALIZED for member in self._members.values()):
            self.end()

    def close(self) -> None:
        """Stop to observe the process."""
        self._lives.close()
        self.requests.close()
        self._reports.close()

    def __str__(self) -> str:
        return f"process '{self._process.name}'"

    # --- start and end

    async def _start(self) -> None:
        """Start the process, or wait for one that is started elsewhere."""
        life = self._lives.current
        if life is not None and life.lost:
            if life.child is None:
                raise ProcessUnavailable(f"{self} {life.lost}")
            await self._kill_child(life, life.child)
        end_s = self._clock.monotonic() + STARTS_WITHIN_S
        refused_s = -REPORTS_WITHIN_S
        child: Child | None = None
        while self._lives.up is None:
            if child is not None and child.ended.done():
                if self._lives.may_start and child.ended.result() != ALREADY_RUNS:
                    raise ProcessUnavailable(f"{self} {child.how_ended}")
                child, refused_s = None, self._clock.monotonic()  # the other one is about to report
            may_start = (
                self._lives.may_start and self._clock.monotonic() - refused_s >= REPORTS_WITHIN_S
            )
            if self._lives.current is None and may_start and not is_held(self._name):
                child = await self._start_child()
            elif self._clock.monotonic() > end_s:
                raise ProcessUnavailable(self._not_reported())
            await sleep(
                self._context.loop, _LOCK_POLL_S if self._lives.current is None else _POLL_S
            )

    def _not_reported(self) -> str:
        """Return that the process has not reported in time, and as much of the reason as known."""
        reason = self._reports.missing
        if self._lives.current is None and is_held(self._name):
            reason += ", and another process holds its instance lock"
        return f"{self} has not reported within {STARTS_WITHIN_S:g} s: {reason}"

    async def _start_child(self) -> Child:
        life = MemberLife(os.urandom(_KEY_BYTES).hex())
        command = self._context.command_of(self._process, life.report_key)
        self._lives.is_ending = False
        try:
            life.child = child = self._context.children.start(command, self._log)
            await child.started
        except (OSError, StartFailed) as error:
            raise ProcessUnavailable(f"{self} cannot be started: {error}") from error
        self._lives.current = life
        child.ended.add_done_callback(
            lambda _: self._context.loop.call_soon(partial(self._lives.end, life, child))
        )
        return child

    async def _kill_child(self, life: MemberLife, child: Child) -> None:
        self._context.children.end(child, 0.0, 0.0)
        while not child.ended.done():
            await sleep(self._context.loop, _POLL_S)
        self._lives.end(life, child)

    # --- reports

    def _receive(self, report: SystemReport, life: MemberLife) -> None:
        has_returned = bool(life.lost) or (life.last is None and life.child is None)
        before = life.states
        if any(before.get(now.node, now).state != now.state for now in report.nodes):
            self.moved_s = self._clock.monotonic()
        self._lives.take(report, life)
        if report.is_stopping:
            if not self._lives.is_ending:
                self._lives.lose(life, "is shutting down")
            return
        life.lost = ""
        self.requests.on_report(report)
        for node in report.nodes:
            member = self._members.get(node.node)
            if member is not None and report.number > life.answered.get(node.node, -1):
                member.on_report(node)
                if has_returned:
                    member.on_process_return()

    def _on_response(self, life: MemberLife, node: str, done: Future[StepResult]) -> None:
        """Ignore the reports of a node from before the end of its transition."""
        if done.cancelled():
            return
        self.moved_s = self._clock.monotonic()
        if done.exception() is None and done.result().success:
            life.answered[node] = done.result().report

    def _fail(self, reason: str, is_expected: bool) -> None:
        self.requests.fail(ProcessUnavailable(reason))
        if not is_expected:
            with self._context.together():
                for member in tuple(self._members.values()):
                    member.on_process_end(reason)

    def _log(self, text: str, is_error: bool) -> None:
        loggers = process_loggers(self._process.name.value, self._members)
        level, logger, message = attribute_line(text, loggers, is_error=is_error)
        self._context.write_log(level, logger, printable(message))
