"""What a subscription has received and works on in turn."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Coroutine
from functools import partial
from typing import Any, Protocol

from composer.model import Port
from composer.runtime.core import Core
from composer.runtime.ports.callback import Callback
from composer.runtime.strand import Direct
from composer.runtime.tracing import CallbackTimer


class Keeper(Protocol):
    """Takes what nobody works on."""

    def hold(self, message: Any) -> None:
        """Keep or drop a message that comes while the gate is shut."""

    def count_drop(self) -> None:
        """Count the oldest message, which made room."""


class Mailbox(Callback):
    """The messages of one subscription, in the order in which they were put, as deep as its QoS.

    They are handled on its loop, one per turn of it, so that a flood holds nobody up, and one at a
    time: what a handler awaits, the next message waits for as well. Everything that a message needs
    is in this one object, as in :class:`~composer.runtime.delivery.sender.Sender`.
    """

    __slots__ = (
        "_call_soon",
        "_depth",
        "_gate",
        "_idle",
        "_is_awaiting",
        "_keeper",
        "_messages",
        "_statistics",
        "_turn",
    )
    _overlaps = False

    def __init__(
        self,
        core: Core,
        port: Port,
        handle: Callable[[Any], Any],
        timer: CallbackTimer,
        keeper: Keeper,
    ) -> None:
        """Without a depth it keeps everything. What ``handle`` raises is a fault of the handler's.

        What ``handle`` returns is awaited, where it can be.
        """
        depth = port.qos.profile.queue_depth
        super().__init__(core, f"on_{port.name.value}", handle, timer)
        self._call_soon = core.loop.call_soon
        self._gate = core.gate
        self._statistics = core.statistics
        self._depth = depth
        self._keeper = keeper
        self._messages: deque[Any] = deque(maxlen=depth)
        # Popping is atomic: whoever gets the item has the turn taken, so it is taken once at a
        # time, also where the loop has several threads.
        self._idle = [True]
        self._is_awaiting = False
        self._turn: Callable[[], object] = self._take_turn
        if not (self._overlaps or isinstance(core.strand, Direct)):
            self._turn = partial(core.strand.post, self._take_turn)

    def put(self, message: Any) -> None:
        """Have the message worked on soon, from any thread."""
        messages = self._messages
        if len(messages) == self._depth:
            self._keeper.count_drop()
        messages.append(message)
        idle = self._idle
        if idle:  # as in _begin, but without a call: this is done for each message
            try:
                idle.pop()
            except IndexError:
                return  # somebody was faster
            self._call_soon(self._turn)

    def receive(self, message: Any) -> None:
        """Have the message worked on, at once where nothing waits. To be called on the loop."""
        if not self._gate.incoming:
            self._keeper.hold(message)
            return
        if len(self._messages) == self._depth:
            self._keeper.count_drop()
        self._messages.append(message)
        self._begin(at_once=True)

    def begin_anew(self) -> None:
        """Let go of what has come since the gate was shut, and waits for what was begun before."""
        if self._is_awaiting:
            self.clear()

    def clear(self) -> None:
        """Let go of everything that waits."""
        while self._messages:
            try:
                message = self._messages.popleft()
            except IndexError:
                return  # a turn was faster
            self._keeper.hold(message)

    def close(self) -> None:
        """Take nothing more."""
        self._handle = _ignore
        self._keeper = _Nobody()
        self._messages.clear()

    def _take_turn(self) -> None:
        messages = self._messages
        try:
            message = messages.popleft()
        except IndexError:  # cleared meanwhile
            self._go_on()
            return
        rest = None
        try:
            if self._gate.incoming:
                self._statistics.received += 1
                rest = self._call(message)
            else:
                self._keeper.hold(message)
        finally:
            if rest is not None:
                self._wait_for(rest)
            else:  # as in _go_on, but without a call
                self._idle.append(True)
                if messages:
                    self._begin()

    def _wait_for(self, rest: Coroutine[Any, Any, None]) -> None:
        self._is_awaiting = True
        task = self._core.spawn(self._core.strand.wrap(rest))
        task.add_done_callback(self._resume)

    def _resume(self, _: object) -> None:
        self._is_awaiting = False
        self._go_on()

    def _go_on(self) -> None:
        """Give the turn back; whoever finds that something waits has it taken anew."""
        self._idle.append(True)
        if self._messages:
            self._begin()

    def _begin(self, *, at_once: bool = False) -> None:
        try:
            self._idle.pop()
        except IndexError:
            return  # who has put it there takes the turn
        if at_once:
            self._turn()
        else:
            self._call_soon(self._turn)


class OverlappingMailbox(Mailbox):
    """The messages of a reentrant subscription: none waits for the one before."""

    __slots__ = ()

    _overlaps = True

    def _take_turn(self) -> None:
        try:
            message = self._messages.popleft()
        except IndexError:  # cleared meanwhile
            self._go_on()
            return
        self._go_on()
        if not self._gate.incoming:
            self._keeper.hold(message)
            return
        self._statistics.received += 1
        rest = self._call(message)
        if rest is not None:
            self._core.spawn(rest)


class _Nobody:
    """Keeps nothing of what comes after the end."""

    def hold(self, message: Any) -> None:
        """Let go of it."""

    def count_drop(self) -> None:
        """Count nothing."""


def _ignore(_: Any) -> None:
    """Do nothing with what comes after the end."""
