"""Callback groups of a class's own type, which decide when their callbacks run."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Coroutine
from dataclasses import replace
from typing import Any, TypeVar

from rclpy.callback_groups import CallbackGroup

from composer.base.fast_dataclass import dataclass
from composer.runtime.executors.futures import Future
from composer.runtime.executors.strand import as_a_whole
from composer.runtime.hosting.user_code import UserCode, UserFunction

T = TypeVar("T")

#: How often a group that has refused a callback is asked again. rclpy asks at each wake-up.
_ASK_AGAIN_S = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class _Item:
    """A call of an entity, or the future of a coroutine that waits to begin."""

    entity: object
    work: Callable[[], object] | Future[None]
    is_due: Callable[[], bool] = lambda: True


class OwnGroup:
    """Asks a callback group before each callback, as rclpy's executors do, and reports the end.

    Callbacks that it refuses wait. Those of one entity run one at a time in any case. If the group
    raises, that is an error of the node, and the callback runs.
    """

    def __init__(self, code: UserCode, group: CallbackGroup) -> None:
        self._code = code
        self._can_execute = UserFunction(code, group.can_execute)
        self._beginning = UserFunction(code, group.beginning_execution)
        self._ending = UserFunction(code, group.ending_execution)
        self._waiting: deque[_Item] = deque()
        self._lock = threading.RLock()
        self._running: set[object] = set()  # entities
        self._will_ask = False

    def strand(self, entity: object) -> EntityStrand:
        """Return the strand of a timer, subscription or service of the group."""
        return EntityStrand(self, entity)

    def add(self, item: _Item) -> None:
        """Run the item as soon as the group permits."""
        self._waiting.append(item)
        self._run_permitted()

    def ended(self, entity: object) -> None:
        """Let the group know that a callback of the entity has ended."""
        self._ask(self._ending, entity)
        with self._lock:
            self._running.discard(entity)
        if self._waiting:
            self._code.context.loop.call_soon(self._run_permitted)

    def _ask(self, question: UserFunction, entity: object) -> object:
        try:
            return question(entity)
        except BaseException as error:
            self._code.context.error_log.exception(question.__name__, error)
            return True

    def _run_permitted(self) -> None:
        while (item := self._next_permitted()) is not None:
            self._run(item.entity, item.work)
        if self._waiting and not (self._will_ask or self._code.ended.is_set()):
            self._will_ask = True
            self._code.context.loop.call_later(_ASK_AGAIN_S, self._ask_again)

    def _next_permitted(self) -> _Item | None:
        """Remove and return the first item that the group lets begin; :meth:`ended` follows."""
        with self._lock:
            seen = set(self._running)
            for item in tuple(self._waiting):
                entity = item.entity
                if entity in seen:
                    continue
                if not item.is_due():
                    self._waiting.remove(item)
                    continue
                seen.add(entity)
                if self._ask(self._can_execute, entity) and self._ask(self._beginning, entity):
                    self._waiting.remove(item)
                    self._running.add(entity)
                    return item
        return None

    def _ask_again(self) -> None:
        self._will_ask = False
        self._run_permitted()

    def _run(self, entity: object, work: Callable[[], object] | Future[None]) -> None:
        if isinstance(work, Future):
            if not work.set_result(None):  # canceled while it waited
                self.ended(entity)
            return
        _CURRENT.entity = entity
        try:
            work()
        finally:
            # A coroutine of the callback ends it.
            has_ended, _CURRENT.entity = _CURRENT.entity is entity, None
            if has_ended:
                self.ended(entity)


class _Current(threading.local):
    entity: object = None


#: The entity whose callback has begun in the calling thread, until a coroutine takes it over.
_CURRENT = _Current()


class EntityStrand:
    """Runs the callbacks of one entity of a group."""

    def __init__(self, group: OwnGroup, entity: object) -> None:
        self._group = group
        self._entity = entity

    def post(self, call: Callable[[], object], is_due: Callable[[], bool] | None = None) -> None:
        """Run ``call`` as soon as the group permits; drop it if it is not due then."""
        item = _Item(self._entity, call)
        self._group.add(item if is_due is None else replace(item, is_due=is_due))

    def wrap(self, coroutine: Coroutine[Any, Any, T]) -> Coroutine[Any, Any, T]:
        """Return a coroutine that the group takes for one callback."""
        if _CURRENT.entity is self._entity:  # it is the rest of a callback that has begun
            _CURRENT.entity = None
            return as_a_whole(_Begun(self), coroutine)
        return as_a_whole(self, coroutine)

    def enter(self) -> Future[None] | None:
        """Begin, or return a future that is done once the group permits it."""
        entered: Future[None] = Future()
        self._group.add(_Item(self._entity, entered))
        return entered

    def leave(self) -> None:
        """End a callback."""
        self._group.ended(self._entity)


class _Begun:
    """The scope of a coroutine whose callback has begun."""

    def __init__(self, strand: EntityStrand) -> None:
        self.leave = strand.leave

    def enter(self) -> None:
        """Do nothing."""
