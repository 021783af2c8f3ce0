"""Finds who changes messages that were published or received: ``compose run --check-mutation``.

Ports of one process share messages by reference, so one that is changed changes for everybody. With
the check on, the serialized form of what a node has published or received lately is compared after
each of its callbacks. That takes long: it is for looking, not for every day.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar
from weakref import WeakValueDictionary

from rclpy.serialization import serialize_message

from composer.runtime.executors.strand import Work, in_steps
from composer.runtime.executors.tasks import Future

T = TypeVar("T")

#: Told (the callback, what it has done).
Tell = Callable[[str, str], None]

_REMEMBERED = 32  # messages of each node


class _Seen:
    """A message and the form it had when it was last looked at."""

    __slots__ = ("__weakref__", "form", "message")

    def __init__(self, message: Any) -> None:
        self.message = message
        self.form = serialize_message(message)


class SeenMessages:
    """Every message that a node of the process remembers, once."""

    def __init__(self) -> None:
        self._by_identity: WeakValueDictionary[int, _Seen] = WeakValueDictionary()

    def of(self, message: Any) -> _Seen:
        """Return what is known of the message; as it is now, where that is nothing."""
        seen = self._by_identity.get(id(message))
        if seen is None:
            seen = self._by_identity[id(message)] = _Seen(message)
        return seen


class MutationCheck:
    """What one node has published and received lately, and whether it is as it was."""

    def __init__(self, messages: SeenMessages, tell: Tell) -> None:
        self._messages = messages
        self._tell = tell
        self._lately: deque[tuple[_Seen, str]] = deque(maxlen=_REMEMBERED)

    def remember(self, message: Any, what: str) -> None:
        """Look at the message from now on; ``what`` is told of it: ``published by 'odometry'``."""
        self._lately.append((self._messages.of(message), what))

    def around(self, callback: str, work: Work[T]) -> Work[T]:
        """Return ``work``, after which everything is looked at."""

        def watched(item: T) -> Coroutine[Any, Any, None] | None:
            try:
                rest = work(item)
            finally:
                self.look(callback)
            return None if rest is None else self.steps(callback, rest)

        return watched

    def steps(self, callback: str, coroutine: Coroutine[Any, Any, T]) -> Coroutine[Any, Any, T]:
        """Return ``coroutine``, after each step of which everything is looked at."""
        return in_steps(_Look(self, callback), coroutine)

    def look(self, callback: str) -> None:
        """Tell what has changed since the last look: it was ``callback``."""
        for seen, what in tuple(self._lately):
            form = serialize_message(seen.message)
            if form != seen.form:
                seen.form = form
                kind = type(seen.message).__name__
                self._tell(callback, f"has changed a message ({kind}) after it was {what}")


class Remembered:
    """Has each message that is put there looked at from now on."""

    __slots__ = ("_check", "_what")

    def __init__(self, check: MutationCheck, what: str) -> None:
        self._check = check
        self._what = what

    def put(self, message: Any) -> None:
        """Look at the message from now on."""
        self._check.remember(message, self._what)


class _Look:
    """Looks after each step of a coroutine."""

    __slots__ = ("_callback", "_check")

    def __init__(self, check: MutationCheck, callback: str) -> None:
        self._check = check
        self._callback = callback

    def enter(self) -> Future[None] | None:
        """Begin a step, at once."""
        return None

    def leave(self) -> None:
        """Look."""
        self._check.look(self._callback)
