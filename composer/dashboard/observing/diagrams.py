"""The diagrams of the last views, each laid out once for all pages that show it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from composer.dashboard.pictures import Diagram

_MAX_DIAGRAMS = 4


class Diagrams:
    """Diagrams by what they depend on. Use it on worker threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._known: dict[Hashable, Diagram] = {}

    def of(self, key: Hashable, lay_out: Callable[[], Diagram]) -> Diagram:
        """Return the diagram with this key; the first call lays it out, and others wait for it."""
        # One at a time: layouts are Python code, of which only one thread runs at any time.
        with self._lock:
            diagram = self._known.pop(key, None) or lay_out()
            self._known[key] = diagram
            while len(self._known) > _MAX_DIAGRAMS:
                del self._known[next(iter(self._known))]
            return diagram
