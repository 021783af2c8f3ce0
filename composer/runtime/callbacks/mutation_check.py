"""Finds callbacks that change published or received messages: ``compose run --check-mutation``.

Ports of one process share messages by reference, so a change affects all of them. The check
compares the serialized form of a node's latest messages after each of its callbacks. That is slow:
it is for debugging, not for production.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar
from weakref import WeakValueDictionary

from rclpy.serialization import serialize_message

from composer.runtime.executors.futures import Future
from composer.runtime.executors.strand import Work, in_steps

T = TypeVar("T")

#: Called with (the callback, what it did).
Report = Callable[[str, str], None]

_REMEMBERED = 32  # messages per node


class _Snapshot:
    """A message and its serialized form at the last check."""

    __slots__ = ("__weakref__", "form", "message")

    def __init__(self, message: Any) -> None:
        self.message = message
        self.form = serialize_message(message)


class MessageSnapshots:
    """One snapshot of each message that a node of the process remembers."""

    def __init__(self) -> None:
        self._by_identity: WeakValueDictionary[int, _Snapshot] = WeakValueDictionary()

    def of(self, message: Any) -> _Snapshot:
        """Return the snapshot of the message, a new one if there is none."""
        snapshot = self._by_identity.get(id(message))
        if snapshot is None:
            snapshot = self._by_identity[id(message)] = _Snapshot(message)
        return snapshot


class MutationCheck:
    """The latest messages of one node, and whether they have changed."""

    def __init__(self, snapshots: MessageSnapshots, report: Report) -> None:
        self._snapshots = snapshots
        self._report = report
        self._latest: deque[tuple[_Snapshot, str]] = deque(maxlen=_REMEMBERED)

    def remember(self, message: Any, origin: str) -> None:
        """Check the message from now on; ``origin`` is reported: ``published by 'odometry'``."""
        self._latest.append((self._snapshots.of(message), origin))

    def wrap(self, callback: str, work: Work[T]) -> Work[T]:
        """Return ``work``, followed by a check."""

        def checked(item: T) -> Coroutine[Any, Any, None] | None:
            try:
                rest = work(item)
            finally:
                self.check(callback)
            return None if rest is None else self.wrap_steps(callback, rest)

        return checked

    def wrap_steps(
        self, callback: str, coroutine: Coroutine[Any, Any, T]
    ) -> Coroutine[Any, Any, T]:
        """Return ``coroutine`` with a check after each of its steps."""
        return in_steps(_CheckAfter(self, callback), coroutine)

    def check(self, callback: str) -> None:
        """Report messages that have changed since the last check: ``callback`` changed them."""
        for snapshot, origin in tuple(self._latest):
            form = serialize_message(snapshot.message)
            if form != snapshot.form:
                snapshot.form = form
                kind = type(snapshot.message).__name__
                self._report(callback, f"modified a message ({kind}) after it was {origin}")


class RememberingTarget:
    """Remembers each message that is put."""

    __slots__ = ("_check", "_origin")

    def __init__(self, check: MutationCheck, origin: str) -> None:
        self._check = check
        self._origin = origin

    def put(self, message: Any) -> None:
        """Check the message from now on."""
        self._check.remember(message, self._origin)


class _CheckAfter:
    """Checks after each step of a coroutine."""

    __slots__ = ("_callback", "_check")

    def __init__(self, check: MutationCheck, callback: str) -> None:
        self._check = check
        self._callback = callback

    def enter(self) -> Future[None] | None:
        """Begin a step, at once."""
        return None

    def leave(self) -> None:
        """Check."""
        self._check.check(self._callback)
