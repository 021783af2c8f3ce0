"""What a node may do right now, as its lifecycle state allows."""

from __future__ import annotations

from composer.behavior import CallCancelled
from composer.runtime.intra_process.pending import Pending


class Gate:
    """Three doors of one node, and what waits for something to come back through them.

    ``incoming`` is open in *active* alone: messages, requests, goals and timers get in.
    ``outgoing`` is open from the start of *activating* to the end of *deactivating*, so that a
    node may say a first and a last word: publish, call, send goals. ``waiting`` is open as well
    while any other transition is on its way: a lifecycle handler may sleep.
    """

    __slots__ = (
        "_had_outgoing",
        "_node",
        "incoming",
        "outgoing",
        "pending",
        "period",
        "state",
        "waiting",
    )

    def __init__(self, node: str, pending: Pending) -> None:
        """``pending`` is what somebody waits for: it ends when the node leaves *active*."""
        self._node = node
        self._had_outgoing: bool | None = None  # before it was hushed
        self.pending = pending
        self.incoming = False
        self.outgoing = False
        self.waiting = False
        self.state = "unconfigured"
        self.period = 0  # counts how often what waits was ended

    @property
    def refusal(self) -> str:
        """Why nothing gets through now."""
        if self._had_outgoing is not None:
            return f"{self._node} has failed"
        return f"{self._node} is {self.state}, not active"

    def hush(self) -> None:
        """Let nothing through until the next transition, from any thread: the node hangs."""
        self._had_outgoing = self.outgoing
        self.incoming = self.outgoing = False

    def end_hush(self) -> None:
        """Let out again what was let out before, for a last word; nothing comes in."""
        if self._had_outgoing is not None:
            self.outgoing = self._had_outgoing
            self._had_outgoing = None

    def open(self) -> None:
        """Open every door."""
        self._had_outgoing = None
        self.incoming = self.outgoing = self.waiting = True

    def close(self) -> None:
        """Shut every door and end what waits."""
        self._had_outgoing = None
        self.incoming = self.outgoing = self.waiting = False
        self.end_pending()

    def end_pending(self) -> None:
        """End all calls, goals and sleeps that somebody in the node waits for."""
        self.period += 1
        self.pending.end(lambda: CallCancelled(self.refusal))
