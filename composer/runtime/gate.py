"""What a node may do right now, as its lifecycle state allows (DESIGN: The runtime, Lifecycle)."""

from __future__ import annotations

from typing import Any

from composer.behavior import CallCancelled
from composer.runtime.tasks import Future


class Gate:
    """Three doors of one node, and what waits for something to come back through them.

    ``incoming`` is open in *active* alone: messages, requests, goals and timers get in.
    ``outgoing`` is open from the start of *activating* to the end of *deactivating*, so that a
    node may say a first and a last word: publish, call, send goals. ``waiting`` is open as well
    while any other transition is on its way: a lifecycle handler may sleep.
    """

    __slots__ = ("_node", "_pending", "incoming", "outgoing", "period", "state", "waiting")

    def __init__(self, node: str) -> None:
        self._node = node
        self._pending: set[Future[Any]] = set()
        self.incoming = False
        self.outgoing = False
        self.waiting = False
        self.state = "unconfigured"
        self.period = 0  # counts how often what waits was ended

    @property
    def refusal(self) -> str:
        """Why nothing gets through now."""
        return f"{self._node} is {self.state}, not active"

    def open(self) -> None:
        """Open every door."""
        self.incoming = self.outgoing = self.waiting = True

    def close(self) -> None:
        """Shut every door and end what waits."""
        self.incoming = self.outgoing = self.waiting = False
        self.end_pending()

    def hold(self, future: Future[Any]) -> Future[Any]:
        """Let ``future`` end with CallCancelled if the node leaves *active* first; return it."""
        self._pending.add(future)
        future.add_done_callback(self._pending.discard)
        return future

    def end_pending(self) -> None:
        """End all calls, goals and sleeps that somebody in the node waits for."""
        self.period += 1
        for future in tuple(self._pending):
            future.set_exception(CallCancelled(self.refusal))
