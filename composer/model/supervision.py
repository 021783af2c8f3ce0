"""Supervision of nodes: detection and handling of failures, and what ROS tools can inspect."""

from __future__ import annotations

from dataclasses import field
from enum import StrEnum

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, Span

#: Default timeout of a transition in milliseconds.
DEFAULT_TIMEOUT_MS = 10_000.0


class OnFailure(StrEnum):
    """How to handle a failed node."""

    RESTART = "restart"
    ISOLATE = "isolate"  # take it and its dependents down, keep the others running
    SHUTDOWN = "shutdown"  # shut down the whole system
    IGNORE = "ignore"  # report it, and move no node


@dataclass(frozen=True, slots=True)
class RestartBudget:
    """How often a node is restarted, and with which backoff.

    The first restart within ``window_ms`` waits ``backoff_ms``, each further one twice as long as
    the one before, at most ``backoff_max_ms``. A node that fails again after ``max_attempts``
    restarts is given up, and ``then`` is what happens: isolate or shutdown. ``span`` is the
    location of the declaration, ``backoff_span`` that of the backoff; ``has_window``: it sets
    ``window_ms``.
    """

    max_attempts: int = 5
    then: OnFailure = OnFailure.ISOLATE
    window_ms: float = 60_000.0
    backoff_ms: float = 500.0
    backoff_max_ms: float = 10_000.0
    span: Span | None = field(default=None, compare=False)
    backoff_span: Span | None = field(default=None, compare=False)
    has_window: bool = field(default=False, compare=False)

    def backoff_s(self, attempts: int) -> float:
        """Return the backoff in seconds after ``attempts`` earlier restarts."""
        doublings = min(attempts, 64)  # beyond any limit in a file
        return min(self.backoff_ms * 2.0**doublings, self.backoff_max_ms) / 1000.0


@dataclass(frozen=True, slots=True)
class Watch:
    """When an active node counts as failed, apart from failed transitions. None disables a check.

    ``silence_ms`` is the maximum time without any publication, ``topics`` that of single
    publishers; ``callback_ms`` the maximum duration of a callback; ``max_errors`` the maximum
    number of errors in callbacks within the restart window.
    """

    silence_ms: Located[float] | None = None
    topics: tuple[tuple[Located[str], Located[float]], ...] = ()
    callback_ms: Located[float] | None = None
    max_errors: Located[int] | None = None


@dataclass(frozen=True, slots=True)
class Supervision:
    """The supervision of a node. Settings that a node lacks come from its system."""

    timeout_ms: float = DEFAULT_TIMEOUT_MS  # of each transition
    on_failure: Located[OnFailure] | None = None  # not set: isolate
    restart: RestartBudget = RestartBudget()
    watch: Watch = Watch()

    @property
    def policy(self) -> OnFailure:
        """How to handle a failure of the node."""
        return OnFailure.ISOLATE if self.on_failure is None else self.on_failure.value


#: The default if neither a node nor its system sets anything.
DEFAULT_SUPERVISION = Supervision()


@dataclass(frozen=True, slots=True)
class Introspection:
    """The endpoints of a node for ROS tools; disabled ones are never created.

    ``parameters``: the parameter services (rcl_interfaces); ``rosout``: the publisher of its log on
    /rosout; ``type_description``: the service of that name; ``lifecycle_services``: those of
    lifecycle_msgs. The manager node serves parameters and lifecycle for nodes without these
    services.
    """

    parameters: bool = True
    rosout: bool = True
    type_description: bool = True
    lifecycle_services: bool = True

    @property
    def endpoints(self) -> int:
        """The number of publishers, and of both ends of services."""
        numbers = (
            13 * self.parameters,
            self.rosout,
            2 * self.type_description,
            10 * self.lifecycle_services,
        )
        return 1 + sum(numbers)  # transition_event is always there

    @property
    def left_to_manager(self) -> tuple[str, ...]:
        """The services that the manager node provides for the node: "lifecycle", "parameters"."""
        lifecycle = () if self.lifecycle_services else ("lifecycle",)
        return lifecycle if self.parameters else (*lifecycle, "parameters")


DEFAULT_INTROSPECTION = Introspection()
#: A node outside the process: the manager starts and ends it, all else it has itself.
DRIVEN_BY_MANAGER = Introspection(lifecycle_services=False)
