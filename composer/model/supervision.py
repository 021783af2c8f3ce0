"""What is done about a node that fails, and how it is told that one does."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

from composer.source import Located, Span

#: How long a transition may take, in milliseconds, unless the system says otherwise.
DEFAULT_TIMEOUT_MS = 10_000.0


class OnFailure(StrEnum):
    """What is done about a node that has failed."""

    RESTART = "restart"
    ISOLATE = "isolate"  # it is taken down, with all that depend on it, and the others go on
    SHUTDOWN = "shutdown"  # of the whole system


@dataclass(frozen=True, slots=True)
class RestartBudget:
    """How often a node is restarted, and how long is waited before.

    The first restart within ``window_ms`` comes after ``backoff_ms``, each further one after twice
    the time of the one before, at most ``backoff_max_ms``. A node that fails again after
    ``max_attempts`` of them is given up, and the system with it. ``span`` is where it is declared.
    """

    max_attempts: int = 5
    window_ms: float = 60_000.0
    backoff_ms: float = 500.0
    backoff_max_ms: float = 10_000.0
    span: Span | None = field(default=None, compare=False)

    def backoff_s(self, attempts: int) -> float:
        """Return how long to wait, in seconds, after ``attempts`` earlier restarts."""
        doublings = min(attempts, 64)  # beyond any limit that a file can name
        return min(self.backoff_ms * 2.0**doublings, self.backoff_max_ms) / 1000.0


@dataclass(frozen=True, slots=True)
class Watch:
    """When an active node that raises nothing has failed all the same. None is never.

    ``silence_ms`` is how long it may publish nothing at all, ``topics`` how long nothing through
    one publisher; ``callback_ms`` how long a callback may take; ``max_errors`` how many errors of
    its callbacks may come within the window of its restarts.
    """

    silence_ms: Located[float] | None = None
    topics: tuple[tuple[Located[str], Located[float]], ...] = ()
    callback_ms: Located[float] | None = None
    max_errors: Located[int] | None = None


@dataclass(frozen=True, slots=True)
class Supervision:
    """How a node is kept up. What a node does not say itself, its system says for all."""

    timeout_ms: float = DEFAULT_TIMEOUT_MS  # of each transition
    on_failure: Located[OnFailure] | None = None  # nobody said: isolate
    restart: RestartBudget = RestartBudget()
    watch: Watch = Watch()

    @property
    def policy(self) -> OnFailure:
        """What is done when the node has failed."""
        return OnFailure.ISOLATE if self.on_failure is None else self.on_failure.value


#: What holds where neither a node nor its system says anything.
DEFAULT_SUPERVISION = Supervision()
