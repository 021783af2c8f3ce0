"""What waits between a publisher and the callback of a co-located subscription."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

Receive = Callable[[Any], None]
CallSoon = Callable[[Callable[[], object]], None]


class Queue:
    """The messages of one subscription, in the order in which they were put, as deep as its QoS.

    ``put`` may be called from any thread; ``receive`` is called on the subscription's loop, with
    one message per turn of it, so that a flood holds nobody up.
    """

    __slots__ = ("_call_soon", "_depth", "_idle", "_messages", "_on_drop", "_receive", "_serve")

    def __init__(
        self,
        call_soon: CallSoon,
        receive: Receive,
        depth: int | None,
        on_drop: Callable[[], None],
    ) -> None:
        """Without ``depth`` it keeps everything. ``on_drop`` is told that the oldest made room."""
        self._call_soon = call_soon
        self._receive = receive
        self._depth = depth
        self._on_drop = on_drop
        self._messages: deque[Any] = deque(maxlen=depth)
        # Popping is atomic: whoever gets the item has the loop call, so it is called once at a
        # time, also where the loop has several threads.
        self._idle = [True]
        self._serve = self._take_turn

    def put(self, message: Any) -> None:
        """Have the message received."""
        messages = self._messages
        if len(messages) == self._depth:
            self._on_drop()
        messages.append(message)
        idle = self._idle
        if idle:  # as in _take_another, but without a call: this is done for each message
            try:
                idle.pop()
            except IndexError:
                return  # somebody was faster
            self._call_soon(self._serve)

    def close(self) -> None:
        """Have nothing received any more."""
        self._receive = _ignore

    def _take_turn(self) -> None:
        messages = self._messages
        try:
            self._receive(messages.popleft())
        finally:
            if messages:
                self._call_soon(self._serve)
            else:
                self._idle.append(True)
                if messages:  # put there while nobody thought us idle
                    self._take_another()

    def _take_another(self) -> None:
        try:
            self._idle.pop()
        except IndexError:
            return  # who has put it there takes the turn
        self._call_soon(self._serve)


def _ignore(_: Any) -> None:
    """Receive what comes after the end."""
