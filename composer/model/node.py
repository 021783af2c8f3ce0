"""A node of a system, merged from its type and its own entry, and its supervision."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field
from enum import StrEnum
from pathlib import Path
from typing import Protocol, TypeVar

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, Span
from composer.language.tree import Plain
from composer.model.implementation import (
    BehaviorReference,
    Component,
    Executable,
    External,
    HostedClass,
    ImplementationKind,
    Outside,
)
from composer.model.names import join_node_name
from composer.model.ports import (
    Event,
    LogLevel,
    Parameter,
    ParameterSection,
    PeriodError,
    Port,
    PortKind,
    Reaction,
    Timer,
)
from composer.model.transforms import Transforms

#: Default timeout of a transition in milliseconds.
DEFAULT_TIMEOUT_MS = 10_000.0


#: Services of every node for tools, with their types.
PARAMETER_SERVICES = {
    "describe_parameters": "rcl_interfaces/srv/DescribeParameters",
    "get_parameter_types": "rcl_interfaces/srv/GetParameterTypes",
    "get_parameters": "rcl_interfaces/srv/GetParameters",
    "list_parameters": "rcl_interfaces/srv/ListParameters",
    "set_parameters": "rcl_interfaces/srv/SetParameters",
    "set_parameters_atomically": "rcl_interfaces/srv/SetParametersAtomically",
}
LIFECYCLE_SERVICES = {
    "change_state": "lifecycle_msgs/srv/ChangeState",
    "get_state": "lifecycle_msgs/srv/GetState",
    "get_available_states": "lifecycle_msgs/srv/GetAvailableStates",
    "get_available_transitions": "lifecycle_msgs/srv/GetAvailableTransitions",
    "get_transition_graph": "lifecycle_msgs/srv/GetAvailableTransitions",
}
LOGGER_SERVICES = {
    "get_logger_levels": "rcl_interfaces/srv/GetLoggerLevels",
    "set_logger_levels": "rcl_interfaces/srv/SetLoggerLevels",
}
TOOL_SERVICES = {
    **PARAMETER_SERVICES,
    **LIFECYCLE_SERVICES,
    **LOGGER_SERVICES,
    "get_type_description": "type_description_interfaces/srv/GetTypeDescription",
}


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
    lifecycle_msgs; ``logger_services``: those for the levels of loggers (rcl_interfaces). Commands
    ask the manager node for the parameters, the lifecycle and the levels of nodes without these
    services. Levels of loggers are off, as in rclpy: they belong to the process, and their two
    services in each of 100 nodes made the start a fifth longer.
    """

    parameters: bool = True
    rosout: bool = True
    type_description: bool = True
    lifecycle_services: bool = True
    logger_services: bool = False

    @property
    def endpoints(self) -> int:
        """The number of publishers, and of both ends of services."""
        numbers = (
            13 * self.parameters,
            self.rosout,
            2 * self.type_description,
            10 * self.lifecycle_services,
            4 * self.logger_services,
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


class _Named(Protocol):
    @property
    def name(self) -> Located[str]: ...


N = TypeVar("N", bound=_Named)


def by_name(items: Iterable[N]) -> dict[str, N]:
    """Return the items by name; the first of duplicates."""
    found: dict[str, N] = {}
    for item in items:
        found.setdefault(item.name.value, item)
    return found


@dataclass(frozen=True, slots=True)
class Remapping:
    """A remapping of the declared name ``source`` to ``target``."""

    source: Located[str]
    target: Located[str]


class PrimaryState(StrEnum):
    """The primary lifecycle states that a node can start in or wait for."""

    UNCONFIGURED = "unconfigured"
    INACTIVE = "inactive"
    ACTIVE = "active"


@dataclass(frozen=True, slots=True)
class Dependency:
    """Another node that must be in ``state`` before this one enters it.

    A container must be active before its component is configured.
    """

    node: Located[str]
    state: PrimaryState = PrimaryState.ACTIVE
    is_container: bool = False


@dataclass(frozen=True, slots=True)
class UnknownKey:
    """A key of a node that its node type does not have."""

    section: str  # "parameters", "publishers", "timers", ...
    name: Located[str]
    known: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Node:
    """One node of a system, merged from its type (where it has one) and its own entry.

    ``name`` is its key in the system, ``own_name`` its name in ROS if that differs.
    """

    name: Located[str]
    namespace: Located[str]  # absolute
    span: Span = field(compare=False)
    own_name: Located[str] | None = None
    type_name: Located[str] | None = None
    type_found: bool = True
    type_files: tuple[Path, ...] = field(default=(), compare=False)  # its own and its base types'
    own_type_name: Located[str] | None = None  # as the file of its type names it
    description: str = ""
    behavior: BehaviorReference | None = None
    hosted_class: HostedClass | None = None
    executable: Executable | None = None
    component: Component | None = None
    container: Located[str] | None = None  # the node that loads its component
    conflicting: tuple[Located[str], ...] = ()  # the keys of its implementations, if several
    external: External | None = None  # takes precedence over the implementation of its type
    #: Names of nodes that its program keeps, besides its own. See ``Executable.nodes``.
    inner_nodes: tuple[str, ...] = ()
    keeps_names: bool = False
    #: Whether parameters and remappings reach it even if it does not declare them.
    gets_undeclared: bool = False
    parameters: tuple[Parameter, ...] = ()
    undeclared_parameters: tuple[Parameter, ...] = ()  # those that it gets, with their values
    #: What the program of an executable gets, in the order of a parameter file.
    parameter_sections: tuple[ParameterSection, ...] = field(default=(), compare=False)
    #: With the values of parameter files that the system replaces.
    overridden_parameters: tuple[Parameter, ...] = field(default=(), compare=False)
    ports: tuple[Port, ...] = ()
    timers: tuple[Timer, ...] = ()
    transforms: Transforms | None = None
    state: tuple[tuple[Located[str], Plain], ...] = ()
    reactions: tuple[tuple[Event, Reaction], ...] = ()
    remappings: tuple[Remapping, ...] = ()
    executor: Located[str] | None = None
    process: Located[str] | None = None  # not set: as the system
    log_level: Located[LogLevel] | None = None  # None: as the run
    required: bool = True  # False: the system is up without it
    depends_on: tuple[Dependency, ...] = ()
    autostart: Located[PrimaryState] | None = None
    supervision: Supervision = DEFAULT_SUPERVISION
    introspection: Introspection = DEFAULT_INTROSPECTION
    unknown: tuple[UnknownKey, ...] = ()
    given: tuple[Located[str], ...] = field(default=(), compare=False)  # the keys of its entry
    complete: bool = True  # False: its type is unknown or invalid
    full_name: str = field(init=False, repr=False, compare=False)  # in ROS
    #: The initial values of the parameters that have one, by name.
    initial_parameters: Mapping[str, object] = field(init=False, repr=False, compare=False)
    _ports: dict[str, Port] = field(init=False, repr=False, compare=False)
    _parameters: dict[str, Parameter] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        values = {
            parameter.name.value: parameter.value.value
            for parameter in self.parameters
            if parameter.value is not None
        }
        full_name = join_node_name(self.namespace.value, self.ros_name.value)
        object.__setattr__(self, "full_name", full_name)
        object.__setattr__(self, "initial_parameters", values)
        object.__setattr__(self, "_ports", by_name(self.ports))
        object.__setattr__(self, "_parameters", by_name(self.parameters))

    @property
    def ros_name(self) -> Located[str]:
        """The name of the node in ROS, without its namespace."""
        return self.name if self.own_name is None else self.own_name

    @property
    def in_process(self) -> bool:
        """Whether the node runs in the process of its system."""
        return self.process is None and self.implementation.in_process

    @property
    def implementation(self) -> ImplementationKind:
        """What implements the node."""
        if self.external is not None:
            return ImplementationKind.EXTERNAL
        if self.executable is not None:
            return ImplementationKind.EXECUTABLE
        if self.component is not None:
            return ImplementationKind.COMPONENT
        if self.hosted_class is not None:
            return ImplementationKind.CLASS
        if self.behavior is not None:
            return ImplementationKind.BEHAVIOR
        return ImplementationKind.DECLARATIVE

    @property
    def outside(self) -> Outside | None:
        """What implements the node outside the process; None if it runs in the process."""
        return self.external or self.executable or self.component

    def port(self, name: str) -> Port | None:
        """Return the port called ``name``, or None."""
        return self._ports.get(name)

    @property
    def all_ports(self) -> tuple[Port, ...]:
        """The ports, and the ports on /tf and /tf_static that follow from ``transforms``."""
        return self.ports if self.transforms is None else self.ports + self.transforms.ports

    @property
    def visible_ports(self) -> tuple[Port, ...]:
        """All ports as ROS tools see them: for behaviors, the manager listens to /tf."""
        if self.transforms is None or not self.implementation.declares_everything:
            return self.all_ports
        return self.ports + self.transforms.publishers

    def ports_of(self, *kinds: PortKind) -> tuple[Port, ...]:
        """Return the ports of the given kinds, in order."""
        return tuple(port for port in self.ports if port.kind in kinds)

    def period_s(self, timer: Timer) -> float | None:
        """Return a timer's period with the initial parameters; None if it has no valid one."""
        try:
            return timer.period.seconds(self.initial_parameters)
        except PeriodError:
            return None

    def parameter(self, name: str) -> Parameter | None:
        """Return the parameter called ``name``, or None."""
        return self._parameters.get(name)
