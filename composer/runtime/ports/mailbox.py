"""What a subscription has received and works on in turn."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from functools import partial
from math import inf
from typing import Any, Protocol

from composer.model import Port
from composer.runtime.callbacks.callback import Callback
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.executors.loop import Taken
from composer.runtime.executors.strand import InlineStrand
from composer.runtime.metrics.statistics import CallbackStatistics
from composer.runtime.ports.queue import Queue, queue_of

#: The queue and the turn of a mailbox, and objects that are used when a message is handled.
Needed = tuple[Queue, Callable[[], object], object, object, object, object, object, object, object]


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
    is in this one object, as in :class:`~composer.runtime.intra_process.publisher.Sender`.

    Each message brings a turn along. One that pushes another out does not, or a flood would fill
    the loop; there, and after a handler that awaited, an extra turn takes one message and sees to
    it that whatever is left is taken.
    """

    __slots__ = (
        "_depth",
        "_extra_turn",
        "_gate",
        "_has_no_extra",
        "_is_awaiting",
        "_is_direct",
        "_keeper",
        "_loop",
        "_messages",
        "_needed",
        "_turn",
        "count",
    )
    _overlaps = False

    def __init__(
        self,
        core: NodeContext,
        port: Port,
        handle: Callable[[Any], Any],
        statistics: CallbackStatistics,
        keeper: Keeper,
    ) -> None:
        """Without a depth it keeps everything. What ``handle`` raises is a fault of the handler's.

        What ``handle`` returns is awaited, where it can be.
        """
        depth = port.qos.profile.queue_depth
        super().__init__(core, f"on_{port.name.value}", handle, statistics, port.budget_ms)
        self._loop = core.loop
        self._gate = core.gate
        #: How many messages were given to the handler.
        self.count = 0
        self._depth = inf if depth is None else depth
        self._keeper = keeper
        self._messages = queue_of(self._depth)
        # Popping is atomic: there is one extra turn at a time, whichever thread wants it.
        self._has_no_extra = [True]
        self._is_awaiting = False
        # On a loop of one thread one is at a time anyway.
        self._is_direct = self._overlaps or isinstance(core.strand, InlineStrand)
        self._turn = self._one_at_a_time(self._take_turn)
        self._extra_turn = self._one_at_a_time(self._take_extra_turn)
        self._needed = self._what_is_needed()

    def put(self, message: Any) -> None:
        """Have the message worked on soon, from any thread."""
        # Most of these are used later only. What was not used for some milliseconds has to be
        # fetched from far away; when it is asked for all at once, the fetching overlaps.
        messages, turn, _, _, _, _, _, _, _ = self._needed
        if len(messages) >= self._depth:
            self._make_room()
            messages.append(message)
            self._ask_for_extra()
        else:
            messages.append(message)
            self._loop.call_soon(turn)

    def receive(self, taken: Taken) -> None:
        """Have the message worked on, at once where nothing waits. To be called on the loop."""
        message, _ = taken
        if not self._gate.incoming:
            self._keeper.hold(message)
        elif self._messages or self._is_awaiting:
            self.put(message)
        elif self._is_direct:  # as in _take_turn: nobody else can take it out of turn
            self.count += 1
            rest = self._call(message)
            if rest is not None:
                self._wait_for(rest)
        else:
            self._messages.append(message)
            self._turn()

    def begin_anew(self) -> None:
        """Let go of what has come since the gate was shut, and waits for what was begun before."""
        self._needed = self._what_is_needed()
        if self._is_awaiting:
            self.clear()

    def clear(self) -> None:
        """Let go of everything that waits."""
        while self._messages:
            try:
                message = self._messages.pop(0)
            except IndexError:
                return  # a turn was faster
            self._keeper.hold(message)

    def close(self) -> None:
        """Take nothing more."""
        self._handle = _ignore
        self._keeper = _Nobody()
        self._messages.clear()

    def _make_room(self) -> None:
        while len(self._messages) >= self._depth:
            try:
                self._messages.pop(0)
            except IndexError:
                return  # a turn was faster, or another thread
            self._keeper.count_drop()

    def _what_is_needed(self) -> Needed:
        first, second, third, fourth, *_ = (*self._core.used, None, None, None, None)
        mine = (self._messages, self._turn, self._gate, self._handle, self._waiting)
        return (*mine, first, second, third, fourth)

    def _one_at_a_time(self, take: Callable[[], object]) -> Callable[[], object]:
        return take if self._is_direct else partial(self._core.strand.post, take)

    def _take_turn(self) -> None:
        if self._is_awaiting:
            return  # an extra turn comes after it
        try:
            message = self._messages.pop(0)
        except IndexError:
            return  # cleared meanwhile, or pushed out
        if not self._gate.incoming:
            self._keeper.hold(message)
            return
        self.count += 1
        rest = self._call(message)
        if rest is not None:
            self._wait_for(rest)

    def _wait_for(self, rest: Coroutine[Any, Any, None]) -> None:
        self._is_awaiting = True
        task = self._core.spawn(self._core.strand.wrap(rest))
        task.add_done_callback(self._resume)

    def _resume(self, _: object) -> None:
        self._is_awaiting = False
        if self._messages:
            self._ask_for_extra()

    def _ask_for_extra(self) -> None:
        try:
            self._has_no_extra.pop()
        except IndexError:
            return  # it is on its way, and has not begun
        self._loop.call_soon(self._extra_turn)

    def _take_extra_turn(self) -> None:
        self._has_no_extra.append(True)  # first: what comes from now on may ask for the next
        try:
            self._take_turn()
        finally:
            if self._messages and not self._is_awaiting:
                self._ask_for_extra()


class OverlappingMailbox(Mailbox):
    """The messages of a reentrant subscription: none waits for the one before."""

    __slots__ = ()

    _overlaps = True

    def _wait_for(self, rest: Coroutine[Any, Any, None]) -> None:
        self._core.spawn(rest)


class _Nobody:
    """Keeps nothing of what comes after the end."""

    def hold(self, message: Any) -> None:
        """Let go of it."""

    def count_drop(self) -> None:
        """Count nothing."""


def _ignore(_: Any) -> None:
    """Do nothing with what comes after the end."""
