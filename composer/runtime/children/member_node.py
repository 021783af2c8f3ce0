"""A node in another process of the system."""

from __future__ import annotations

from collections.abc import Mapping
from time import monotonic
from typing import Any

from composer.model import Node
from composer.runtime.children.member_process import (
    MemberProcess,
    MemberState,
    ProcessUnavailable,
)
from composer.runtime.children.outside_node import (
    ACTIVE,
    INACTIVE,
    UNCONFIGURED,
    OutsideContext,
    OutsideNode,
    TransitionRefused,
)
from composer.runtime.children.remote_lifecycle import GOALS, PRIMARY_STATES
from composer.runtime.node.outcome import FINALIZED, TransitionOutcome

#: A report follows a successful response at once; each second there is one in any case.
_REPORTED_WITHIN_S = 2.0
_STARTS_WITHIN_S = 30.0
#: The states of the node in which a transition has nothing to do: a process that ran before the
#: coordinating one keeps its nodes as they are.
_DONE = {
    "configure": (INACTIVE, ACTIVE),
    "activate": (ACTIVE,),
    "deactivate": (INACTIVE, UNCONFIGURED, FINALIZED),
    "cleanup": (UNCONFIGURED, FINALIZED),
    "shutdown": (FINALIZED,),
}


class MemberNode(OutsideNode):
    """The :class:`.ManagedNode` of a node in another process of the system.

    Its process starts with its first transition. What it reports without a request is an external
    transition, or a failure that its process has handled by taking it down.
    """

    def __init__(self, model: Node, process: MemberProcess, context: OutsideContext) -> None:
        super().__init__(model, context)
        self._process = process
        self._reported = ""  # the last primary state
        self._has_failed = False
        process.add(self)

    @property
    def transition_timeout_s(self) -> float:
        """How long a transition may take, including the start of the process."""
        return self._timeout_s + _STARTS_WITHIN_S + _REPORTED_WITHIN_S

    @property
    def pid(self) -> int | None:
        """The id of its process, if that was started here."""
        return self._process.pid

    @property
    def figures(self) -> Mapping[str, Any]:
        """Its rates and counters, by the names of the fields of ``NodeStatus``."""
        reported = self._process.state(self.full_name)
        return {} if reported is None else reported.figures

    def destroy(self) -> None:
        """Do nothing: the node belongs to its process."""

    async def _work(self, transition: str) -> None:
        try:
            if transition == "configure":
                await self._prepare()
            await self._request(transition)
        except ProcessUnavailable as error:
            if transition in ("cleanup", "shutdown"):
                return  # without its process, the node is down
            raise TransitionRefused(str(error), UNCONFIGURED) from error
        if transition == "shutdown":
            self._process.end_if_done()

    async def _prepare(self) -> None:
        """Make sure that the process runs, and that the node can be configured."""
        await self._process.ensure()
        if self._has_failed and self._reported in (INACTIVE, ACTIVE):
            await self._process.kill(f"{self.full_name} hangs")
            await self._process.ensure()

    async def _request(self, transition: str) -> None:
        is_left = transition == "shutdown" and self._process.pid is None
        if is_left or self._reported in _DONE[transition]:
            return  # a process that was not started here may be used again
        end_s = monotonic() + self._timeout_s
        if self._end_s is not None:
            end_s = min(end_s, self._end_s)
        success = await self._process.change(self.full_name, transition, end_s)
        goal = GOALS[transition]
        reported_s = monotonic() + _REPORTED_WITHIN_S
        await self._until(lambda: self._reported == goal or not success, reported_s)
        if not success:
            state = self._reported or UNCONFIGURED
            raise TransitionRefused(f"refused, or failed: it is {state}; see its log", state)

    def on_report(self, reported: MemberState) -> None:
        """Follow the state of the node."""
        state, before = reported.state, self._reported
        is_primary = state in PRIMARY_STATES
        if is_primary:
            self._reported = state
        failed_now = bool(reported.held_down) and not self._has_failed
        self._has_failed = bool(reported.held_down)
        if self._lock.is_held:
            return
        if failed_now:
            self._fail(reported.held_down)  # its process takes it down
        elif is_primary and state not in (self._state, before) and before == self._state:
            self._follow(state)

    def on_process_end(self, reason: str) -> None:
        """Report the end of the process as a failure of the node."""
        self._reported, self._has_failed = "", False
        if not self._lock.is_held and self._state in (INACTIVE, ACTIVE):
            self._fail(reason)

    def on_process_return(self) -> None:
        """Use the node again: its process is there again."""
        self._listener.on_returned()

    def _follow(self, state: str) -> None:
        """Report a transition that another tool has requested from the node itself."""
        transition = {
            UNCONFIGURED: "cleanup",
            INACTIVE: "deactivate" if self._state == ACTIVE else "configure",
            ACTIVE: "activate",
            FINALIZED: "shutdown",
        }[state]
        self._state = state
        self.activations += state == ACTIVE
        self._listener.on_transition_end(TransitionOutcome(transition, state, success=True))
