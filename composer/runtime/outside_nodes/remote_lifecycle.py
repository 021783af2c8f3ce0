"""The lifecycle of a node in another process, driven by its standard services."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from lifecycle_msgs.msg import Transition, TransitionEvent
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.node import Node as RosNode

from composer.runtime.executors.futures import Future
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.tasks import sleep
from composer.runtime.node.managed_node import PRIMARY_STATES

#: An answer that a server sends before it has discovered the client is lost.
_ASK_AGAIN_S = 1.0
_POLL_S = 0.02
_SOON_S = 0.02
_EVENTS_DEPTH = 20
_CONFIRMED_WITHIN_S = 5.0
#: The state in which each transition ends if it succeeds.
GOALS = {
    "configure": "inactive",
    "activate": "active",
    "deactivate": "inactive",
    "cleanup": "unconfigured",
    "shutdown": "finalized",
}
#: The states of a node in another process of the system in which each transition has nothing to do:
#: a process that ran before the coordinating one keeps its nodes as they are.
DONE_IN = {
    "configure": ("inactive", "active"),
    "activate": ("active",),
    "deactivate": ("inactive", "unconfigured", "finalized"),
    "cleanup": ("unconfigured", "finalized"),
    "shutdown": ("finalized",),
}


class NotAnswered(Exception):
    """A node did not answer in time."""


class RemoteLifecycle:
    """Clients of the lifecycle services of one node. Use it on ``loop``.

    A request that reads is repeated each second. A request for a transition is sent again only if
    the node is still in the state it was in.
    """

    def __init__(
        self,
        ros: RosNode,
        loop: Loop,
        full_name: str,
        on_state: Callable[[str, str], None],
    ) -> None:
        """``on_state(start, state)`` is called after transition events.

        ``start`` is the label of the state in which the last transition began. ``state`` is the
        primary state that the service of the node reports: any node can publish an event.
        """
        self._ros = ros
        self._loop = loop
        self._full_name = full_name
        self._get_state = ros.create_client(GetState, f"{full_name}/get_state")
        self._change_state = ros.create_client(ChangeState, f"{full_name}/change_state")
        self._events = ros.create_subscription(
            TransitionEvent, f"{full_name}/transition_event", lambda _: None, _EVENTS_DEPTH
        )

        self._on_state = on_state
        self._event_start: str | None = None  # of the last event that is not confirmed yet
        self._confirmation: Future[None] | None = None
        loop.add_client(self._get_state)
        loop.add_client(self._change_state)
        loop.add_subscription(self._events, self._on_event)

    def close(self) -> None:
        """Destroy the clients."""
        if self._confirmation is not None:
            self._confirmation.cancel()
        for entity in (self._get_state, self._change_state, self._events):
            self._loop.remove(entity)
        self._ros.destroy_client(self._get_state)
        self._ros.destroy_client(self._change_state)
        self._ros.destroy_subscription(self._events)

    async def state(self, end_s: float) -> str:
        """Return the label of the state. Raises NotAnswered at ``end_s`` (monotonic)."""
        while True:
            future = self._get_state.call_async(GetState.Request())
            try:
                response = await self._response(future, end_s)
            finally:
                self._get_state.remove_pending_request(future)
            if response is not None:
                return str(response.current_state.label)

    async def change(self, transition: str, end_s: float) -> tuple[bool, str]:
        """Run a transition; return whether it succeeded, and the state after it.

        Raises NotAnswered at ``end_s`` (monotonic).
        """
        before = await self.state(end_s)
        request = ChangeState.Request(transition=Transition(label=transition))
        while True:
            future = self._change_state.call_async(request)
            try:
                response = await self._response(future, end_s)
                if response is None:
                    after = await self._settled(end_s)
                    if after != before:  # the response was lost, not the request
                        return after == GOALS[transition], after
                    response = await self._response(future, end_s)  # it may be on its way
            finally:
                self._change_state.remove_pending_request(future)
            if response is not None:
                return bool(response.success), await self._settled(end_s)

    def _on_event(self, taken: tuple[Any, Any]) -> None:
        self._event_start = str(taken[0].start_state.label)
        if self._confirmation is None:
            self._confirmation = self._loop.run_task(self._confirm())

    async def _confirm(self) -> None:
        """Ask the node for its state until no event has arrived meanwhile."""
        try:
            while (start := self._event_start) is not None:
                self._event_start = None
                state = await self._settled(time.monotonic() + _CONFIRMED_WITHIN_S)
                self._on_state(self._event_start or start, state)
        except NotAnswered:
            self._event_start = None  # its disappearance is noticed elsewhere
        finally:
            self._confirmation = None

    async def _settled(self, end_s: float) -> str:
        """Return the state once no transition runs."""
        while (state := await self.state(end_s)) not in PRIMARY_STATES:
            await sleep(self._loop, _POLL_S)
        return state

    async def _response(self, future: Any, end_s: float) -> Any:
        """Return the response, None if there is none within a second."""
        now_s = time.monotonic()
        if now_s >= end_s:
            raise NotAnswered(f"{self._full_name} does not answer")
        until_s = min(now_s + _ASK_AGAIN_S, end_s)
        while not future.done() and time.monotonic() < until_s:
            await sleep(self._loop, _POLL_S if time.monotonic() > now_s + _SOON_S else _SOON_S / 4)
        return future.result() if future.done() else None
