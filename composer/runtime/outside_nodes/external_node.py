"""A node that something else starts: it is awaited and observed, but never started or ended."""

from __future__ import annotations

from composer.model import External, Node
from composer.model.lifecycle import ACTIVE, INACTIVE, TRANSITIONS, UNCONFIGURED
from composer.runtime.outside_nodes.outside_node import (
    ObservedNode,
    OutsideContext,
    TransitionRefused,
    elsewhere_text,
)
from composer.runtime.outside_nodes.remote_node import NotAnswered

#: How often an external node is looked for.
PERIOD_S = 0.5


class ExternalNode(ObservedNode):
    """The :class:`.ManagedNode` of an external node.

    It is active once its ports are in the ROS graph. It is driven by its lifecycle services only if
    it is declared as managed, and never shut down.
    """

    def __init__(self, model: Node, external: External, context: OutsideContext) -> None:
        super().__init__(model, external, context)
        self._is_left = False
        self._timer = self.loop.call_every(PERIOD_S, self._check)

    @property
    def transition_timeout_s(self) -> float:
        """How long a transition may take, including the time until the node appears."""
        return self._timeout_s + self._outside.ready_timeout_s

    def destroy(self) -> None:
        """Stop to observe the node."""
        self._timer.cancel()
        self._close_remote()

    def leave(self) -> None:
        """Leave it in its state from now on: another system uses it. Thread-safe."""
        self._is_left = True

    async def _work(self, transition: str) -> None:
        if self._is_left:
            return
        if self._outside.is_managed and transition != "shutdown":
            await self._work_managed(transition)
        elif transition == "activate":
            await self._await(INACTIVE)
        if transition in ("cleanup", "shutdown"):
            self._close_remote()

    async def _await(self, state: str) -> None:
        """Wait until it can be used. Otherwise, raise TransitionRefused with ``state``."""
        limit_s = self._outside.ready_timeout_s
        if not await self._until_ready(self._is_there, self.loop.clock.monotonic() + limit_s):
            self._is_lost = True
            elsewhere = elsewhere_text(self.model, self._presence.names_elsewhere())
            advice = elsewhere or "; start it, or see 'ros2 node list'"
            raise TransitionRefused(f"{self._missing()} after {limit_s:g} s{advice}", state)
        self._is_lost = False

    async def _work_managed(self, transition: str) -> None:
        if transition == "configure":
            await self._await(UNCONFIGURED)
            self._connect_remote()
        if self._remote is None:
            raise TransitionRefused("it is not connected", UNCONFIGURED)
        end_s = self.loop.clock.monotonic() + self._timeout_s
        try:
            state = await self._remote.state(end_s)
            if (
                state in TRANSITIONS[transition].ids
            ):  # otherwise, something else has moved it already
                success, state = await self._remote.change(transition, end_s)
                if not success:
                    raise TransitionRefused(f"its service reports a failure; it is {state}", state)
        except NotAnswered as error:
            text = f"{error} within {self._timeout_s:g} s"
            raise TransitionRefused(text, UNCONFIGURED) from error

    def _check(self) -> None:
        """Notice that the node disappears, and that it returns."""
        if self._lock.is_held or self.state not in (UNCONFIGURED, INACTIVE, ACTIVE):
            return
        is_used = self.state == ACTIVE or self._remote is not None
        if is_used and not self._presence.has_node(self.earlier):
            self._is_lost = True
            self._close_remote()
            self._fail("it has disappeared from the ROS graph", is_awaited=True)
        elif self._is_lost and self._is_there():
            self._is_lost = False
            self._listener.on_returned()
