"""What the event loop keeps about the entities it serves."""

from __future__ import annotations

from composer.runtime.executors.entity_sources import Source
from composer.runtime.executors.readiness import Signal

_ALL = 1 << 32  # more than can wait: to be taken until there is nothing


class Slot:
    """Sources that share one signal. The loop serves them together, one item each."""

    __slots__ = ("_passes_over", "due", "signal", "sources")

    def __init__(self) -> None:
        self.signal = Signal()
        self.sources: tuple[Source, ...] = ()
        self.due = 0  # so many things were announced and are not taken yet
        self._passes_over = True

    def add(self, source: Source) -> None:
        """Serve ``source`` from now on. Raises InvalidHandle when its entity is destroyed."""
        self.sources = (*self.sources, source)
        self._passes_over = self._passes_over and source.passes_over
        try:
            source.attach(self.signal)
        except BaseException:
            self.discard(source)
            raise
        # What came before may have been counted for somebody else.
        self.signal.announce(1 if self._passes_over else _ALL)

    def note_round(self, brought: int) -> None:
        """Note how many things a take from each source has brought."""
        if brought < self.due and (brought or self._passes_over):
            self.due -= brought or 1
        else:
            self.due = 0  # where nothing came, a full queue has pushed out what was announced

    def discard(self, source: Source) -> None:
        """Serve ``source`` no more."""
        self.sources = tuple(kept for kept in self.sources if kept is not source)
        source.detach(self.signal)

    def close(self) -> None:
        """Serve nothing any more."""
        self.sources = ()
        self.signal.close()
