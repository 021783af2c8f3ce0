"""Sources, and groups of them that share one signal."""

from __future__ import annotations

from typing import Any, Protocol

from composer.runtime.executors.entities.readiness import Signal

_ALL = 1 << 32  # more items than can be waiting: take until nothing is left


class EntitySource(Protocol):
    """One entity that a loop serves: one item at a time, so that a loop can serve them in turn.

    ``may_skip`` is true if a take may return nothing although more items follow. A client receives
    all responses of its service and skips those to other clients.
    """

    @property
    def may_skip(self) -> bool:
        """See above."""

    @property
    def name(self) -> str:
        """A description of the entity, for reports."""

    def attach(self, signal: Signal) -> None:
        """Make ``signal`` signal the items of the entity."""

    def detach(self, signal: Signal) -> None:
        """Stop that."""

    def take(self) -> Any:
        """Return the next item, or None."""

    def call(self, taken: Any, /) -> object:
        """Pass the item to its callback."""


class SourceGroup:
    """Sources that share one signal. The loop serves them together, one item each."""

    __slots__ = ("_may_skip", "due", "signal", "sources")

    def __init__(self) -> None:
        self.signal = Signal()
        self.sources: tuple[EntitySource, ...] = ()
        self.due = 0  # items that were signaled and not taken yet
        self._may_skip = True

    def add(self, source: EntitySource) -> None:
        """Serve ``source`` from now on. Raises InvalidHandle if its entity is destroyed."""
        self.sources = (*self.sources, source)
        self._may_skip = self._may_skip and source.may_skip
        try:
            source.attach(self.signal)
        except BaseException:
            self.discard(source)
            raise
        # Items from before may have been signaled to another group.
        self.signal.write(1 if self._may_skip else _ALL)

    def finish_round(self, taken: int) -> None:
        """Update ``due`` after a take from each source, ``taken`` of which returned an item."""
        if taken < self.due and (taken or self._may_skip):
            self.due -= taken or 1
        else:
            self.due = 0  # nothing taken: a full queue has dropped what was signaled

    def discard(self, source: EntitySource) -> None:
        """Stop serving ``source``."""
        self.sources = tuple(kept for kept in self.sources if kept is not source)
        source.detach(self.signal)

    def close(self) -> None:
        """Stop serving all sources."""
        self.sources = ()
        self.signal.close()
