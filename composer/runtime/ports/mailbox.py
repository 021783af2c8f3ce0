"""The mailbox of a subscription: the messages that it received and has not handled yet."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Coroutine
from functools import partial
from math import inf
from typing import Any, Protocol, TypeAlias

from composer.model import Port
from composer.runtime.callbacks.callback import Callback
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.executors.sources import Taken
from composer.runtime.executors.strand import InlineStrand
from composer.runtime.metrics.statistics import CallbackStatistics

#: From this depth on, popping the first item of a list is slow: it moves all others.
_DEEP = 256
#: Messages, the oldest first. Every method is atomic.
MessageQueue: TypeAlias = "list[Any] | _DeepQueue"
#: The queue and turn of a mailbox, and other objects that are used when a message is handled.
Prefetched = tuple[
    MessageQueue, Callable[[], object], object, object, object, object, object, object, object
]


class _DeepQueue(deque[Any]):
    """A deque that pops its first item as a list does."""

    def pop(self, _first: int = 0, /) -> Any:
        """Remove and return the oldest message."""
        return self.popleft()


def message_queue(depth: float) -> MessageQueue:
    """Return a queue for up to about ``depth`` messages.

    A shallow one is a list. An empty list is a single object in memory, while a deque has a
    separate block for 64 messages: one more cache miss per message in a large system.
    """
    return [] if depth < _DEEP else _DeepQueue()


class MailboxOwner(Protocol):
    """Receives the messages that the mailbox does not handle."""

    def hold(self, message: Any) -> None:
        """Keep or drop a message that arrives while the gate is closed."""

    def count_drop(self) -> None:
        """Count a message that was dropped from a full queue."""


class Mailbox(Callback):
    """The messages of one subscription, in order, up to the depth of its QoS.

    They are handled on its loop, one per turn of the loop, so that a flood does not block others,
    and one at a time: while a handler awaits, the next message waits too. One object per endpoint
    holds everything that a message needs, as in
    :class:`~composer.runtime.intra_process.publisher.GatedPublisher`.

    Each message schedules a turn, except one that drops another, or a flood would fill the loop.
    Then, and after a handler that awaited, an extra turn handles one message and schedules another
    one if messages are left.
    """

    __slots__ = (
        "_depth",
        "_extra_turn",
        "_gate",
        "_is_awaiting",
        "_is_inline",
        "_loop",
        "_may_schedule_extra",
        "_messages",
        "_owner",
        "_prefetched",
        "_turn",
        "count",
    )
    _overlaps = False

    def __init__(
        self,
        context: NodeContext,
        port: Port,
        handle: Callable[[Any], Any],
        statistics: CallbackStatistics,
        owner: MailboxOwner,
    ) -> None:
        """Without a depth, the queue is unlimited. Exceptions of ``handle`` are its faults.

        The result of ``handle`` is awaited if it is awaitable.
        """
        depth = port.qos.profile.queue_depth
        super().__init__(context, f"on_{port.name.value}", handle, statistics, port.budget_ms)
        self._loop = context.loop
        self._gate = context.gate
        #: Number of messages passed to the handler.
        self.count = 0
        self._depth = inf if depth is None else depth
        self._owner = owner
        self._messages = message_queue(self._depth)
        # Popping is atomic: only one extra turn is scheduled, whichever threads try.
        self._may_schedule_extra = [True]
        self._is_awaiting = False
        # A loop of one thread runs one callback at a time in any case.
        self._is_inline = self._overlaps or isinstance(context.strand, InlineStrand)
        self._turn = self._on_strand(self._take_turn)
        self._extra_turn = self._on_strand(self._take_extra_turn)
        self._prefetched = self._objects_to_prefetch()

    def put(self, message: Any) -> None:
        """Handle the message soon, from any thread."""
        # Most of these objects are only used later. After some idle milliseconds each is a cache
        # miss; referring to all of them at once lets the misses overlap.
        messages, turn, _, _, _, _, _, _, _ = self._prefetched
        if len(messages) >= self._depth:
            self._make_room()
            messages.append(message)
            self._schedule_extra()
        else:
            messages.append(message)
            self._loop.call_soon(turn)

    def receive(self, taken: Taken) -> None:
        """Handle the message, at once if no other one waits. Call it on the loop."""
        message, _ = taken
        if not self._gate.incoming:
            self._owner.hold(message)
        elif self._messages or self._is_awaiting:
            self.put(message)
        elif self._is_inline:  # as in _take_turn: no other thread can take it
            self.count += 1
            rest = self._call(message)
            if rest is not None:
                self._wait_for(rest)
        else:
            self._messages.append(message)
            self._turn()

    def restart(self) -> None:
        """Prepare for activation: drop what arrived since the gate closed, while one awaits."""
        self._prefetched = self._objects_to_prefetch()
        if self._is_awaiting:
            self.clear()

    def clear(self) -> None:
        """Pass all waiting messages to the owner."""
        while self._messages:
            try:
                message = self._messages.pop(0)
            except IndexError:
                return  # a turn was faster
            self._owner.hold(message)

    def close(self) -> None:
        """Handle nothing more."""
        self._handle = _ignore
        self._owner = _NoOwner()
        self._messages.clear()

    def _make_room(self) -> None:
        while len(self._messages) >= self._depth:
            try:
                self._messages.pop(0)
            except IndexError:
                return  # a turn or another thread was faster
            self._owner.count_drop()

    def _objects_to_prefetch(self) -> Prefetched:
        first, second, third, fourth, *_ = (*self._context.hot_objects, None, None, None, None)
        own = (self._messages, self._turn, self._gate, self._handle, self._batch)
        return (*own, first, second, third, fourth)

    def _on_strand(self, turn: Callable[[], object]) -> Callable[[], object]:
        return turn if self._is_inline else partial(self._context.strand.post, turn)

    def _take_turn(self) -> None:
        if self._is_awaiting:
            return  # an extra turn follows
        try:
            message = self._messages.pop(0)
        except IndexError:
            return  # cleared or dropped meanwhile
        if not self._gate.incoming:
            self._owner.hold(message)
            return
        self.count += 1
        rest = self._call(message)
        if rest is not None:
            self._wait_for(rest)

    def _wait_for(self, rest: Coroutine[Any, Any, None]) -> None:
        self._is_awaiting = True
        task = self._context.spawn(self._context.strand.wrap(rest))
        task.add_done_callback(self._resume)

    def _resume(self, _: object) -> None:
        self._is_awaiting = False
        if self._messages:
            self._schedule_extra()

    def _schedule_extra(self) -> None:
        try:
            self._may_schedule_extra.pop()
        except IndexError:
            return  # one is scheduled and has not begun
        self._loop.call_soon(self._extra_turn)

    def _take_extra_turn(self) -> None:
        self._may_schedule_extra.append(True)  # first, so that new messages can schedule the next
        try:
            self._take_turn()
        finally:
            if self._messages and not self._is_awaiting:
                self._schedule_extra()


class OverlappingMailbox(Mailbox):
    """The mailbox of a reentrant subscription: no message waits for the previous one."""

    __slots__ = ()

    _overlaps = True

    def _call(self, message: Any) -> Coroutine[Any, Any, None] | None:
        self._context.loop.overlap()
        return super()._call(message)

    def _wait_for(self, rest: Coroutine[Any, Any, None]) -> None:
        self._context.spawn(rest)


class _NoOwner:
    """Ignores the messages of a closed mailbox."""

    def hold(self, message: Any) -> None:
        """Drop the message."""

    def count_drop(self) -> None:
        """Count nothing."""


def _ignore(_: Any) -> None:
    """Do nothing with a message that arrives after the mailbox was closed."""
