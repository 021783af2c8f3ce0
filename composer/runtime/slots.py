"""What the event loop keeps about the entities it serves."""

from __future__ import annotations

from composer.runtime.readiness import Signal
from composer.runtime.sources import Source


class Slot:
    """Sources that share one signal. The loop serves them together, one item each."""

    __slots__ = ("again", "ready", "signal", "sources")

    def __init__(self) -> None:
        self.signal = Signal()
        self.sources: tuple[Source, ...] = ()
        # True while in the loop's deque of that name, so that it is in there once.
        self.ready = False
        self.again = False

    def add(self, source: Source) -> None:
        """Serve ``source`` from now on. Raises InvalidHandle when its entity is destroyed."""
        self.sources = (*self.sources, source)
        try:
            source.attach(self.signal)
        except BaseException:
            self.discard(source)
            raise

    def discard(self, source: Source) -> None:
        """Serve ``source`` no more."""
        self.sources = tuple(kept for kept in self.sources if kept is not source)
        source.detach(self.signal)

    def close(self) -> None:
        """Serve nothing any more."""
        self.sources = ()
        self.signal.close()
