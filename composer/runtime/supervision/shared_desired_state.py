"""The desired state that the supervisor and the nodes share."""

from __future__ import annotations

import threading
from collections.abc import Callable

from composer.plan import DesiredState


class SharedDesiredState:
    """The current desired state. Thread-safe.

    Nodes record external transitions, on their own threads, before they answer the request. The
    supervisor changes the rest, on the main thread. The lock gives all changes one order, and is
    held for microseconds only: no transition waits for the supervisor or for another node.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._value = DesiredState({})

    @property
    def value(self) -> DesiredState:
        """The desired state now."""
        return self._value

    def update(self, change: Callable[[DesiredState], DesiredState]) -> DesiredState:
        """Replace the desired state by ``change(desired state)``, and return that."""
        with self._lock:
            self._value = change(self._value)
            return self._value
