"""What a system records of itself."""

from __future__ import annotations

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located
from composer.model.names import matches_wildcard


@dataclass(frozen=True, slots=True)
class Recording:
    """The ``recording`` of a system.

    ``topics`` and ``exclude`` are patterns of full names; without ``topics``, all are recorded.
    ``ring_s`` makes it a flight recorder: it keeps the last seconds, and writes them after a fault.
    A new file begins before one is larger than ``split_mb`` or longer than ``split_s``.
    """

    folder: str = "bags"
    topics: tuple[Located[str], ...] = ()
    exclude: tuple[Located[str], ...] = ()
    ring_s: float | None = None
    split_mb: float | None = None
    split_s: float | None = None

    def includes(self, topic: str) -> bool:
        """Return whether a topic is recorded, by its full name."""
        if any(matches_wildcard(pattern.value, topic) for pattern in self.exclude):
            return False
        patterns = self.topics
        return not patterns or any(matches_wildcard(item.value, topic) for item in patterns)
