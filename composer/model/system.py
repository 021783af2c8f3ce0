"""The system: nodes, connections, chains and executors."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import field
from enum import StrEnum
from pathlib import Path
from typing import Any, Protocol, TypeVar, cast

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, SourceFile, Span
from composer.language.tree import Plain
from composer.model.discovery import Discovery
from composer.model.hosts import Host
from composer.model.implementation import (
    BehaviorReference,
    Executable,
    External,
    HostedClass,
    ImplementationKind,
)
from composer.model.names import join_node_name
from composer.model.ports import (
    ChannelKind,
    Delivery,
    Event,
    Isolation,
    LogLevel,
    Parameter,
    ParameterSection,
    PeriodError,
    Port,
    PortKind,
    Qos,
    Reaction,
    Timer,
)
from composer.model.processes import Process
from composer.model.supervision import (
    DEFAULT_INTROSPECTION,
    DEFAULT_SUPERVISION,
    Introspection,
    Supervision,
)
from composer.model.transforms import Transforms


class _Named(Protocol):
    @property
    def name(self) -> Located[str]: ...


N = TypeVar("N", bound=_Named)
T = TypeVar("T")


def _by_name(items: Iterable[N]) -> dict[str, N]:
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
    """Another node that must be in ``state`` before this one enters it."""

    node: Located[str]
    state: PrimaryState = PrimaryState.ACTIVE


@dataclass(frozen=True, slots=True)
class UnknownKey:
    """A key of a node that its node type does not have."""

    section: str  # "parameters", "publishers", "timers", ...
    name: Located[str]
    known: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class UnmatchedParameters:
    """Values of a parameter file that no node gets.

    Without a ``parameter``, they are for a node that is not there; ``renamed`` is the node that
    they are for if an include gave it a prefix. With a ``parameter``, ``section`` has wildcards,
    and no matching node has that parameter.
    """

    section: Located[str]
    parameter: Located[str] | None
    known: tuple[str, ...]  # full names of nodes, or parameters
    renamed: str | None = None


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
    process: Located[str] | None = None  # not set: that of the system
    log_level: Located[LogLevel] | None = None  # None: that of the run
    required: bool = True  # False: the system is up without it
    depends_on: tuple[Dependency, ...] = ()
    autostart: Located[PrimaryState] | None = None
    supervision: Supervision = DEFAULT_SUPERVISION
    introspection: Introspection = DEFAULT_INTROSPECTION
    unknown: tuple[UnknownKey, ...] = ()
    given: tuple[Located[str], ...] = field(default=(), compare=False)  # the keys of its entry
    complete: bool = True  # False: its type is unknown or invalid
    _ports: dict[str, Port] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_ports", _by_name(self.ports))

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
        if self.hosted_class is not None:
            return ImplementationKind.CLASS
        if self.behavior is not None:
            return ImplementationKind.BEHAVIOR
        return ImplementationKind.DECLARATIVE

    @property
    def full_name(self) -> str:
        """The full name of the node in ROS."""
        return join_node_name(self.namespace.value, self.ros_name.value)

    def port(self, name: str) -> Port | None:
        """Return the port called ``name``, or None."""
        return self._ports.get(name)

    @property
    def all_ports(self) -> tuple[Port, ...]:
        """The ports, and those on /tf and /tf_static that follow from ``transforms``."""
        return self.ports if self.transforms is None else self.ports + self.transforms.ports

    @property
    def visible_ports(self) -> tuple[Port, ...]:
        """The same, as ROS tools see them: the manager listens to /tf for our own nodes."""
        if self.transforms is None or not self.implementation.declares_everything:
            return self.all_ports
        return self.ports + self.transforms.publishers

    def ports_of(self, *kinds: PortKind) -> tuple[Port, ...]:
        """Return the ports of the given kinds, in order."""
        return tuple(port for port in self.ports if port.kind in kinds)

    @property
    def initial_parameters(self) -> dict[str, object]:
        """The initial values of the parameters that have one, by name."""
        return {
            parameter.name.value: parameter.value.value
            for parameter in self.parameters
            if parameter.value is not None
        }

    def period_s(self, timer: Timer) -> float | None:
        """Return a timer's period with the initial parameters; None if it has no valid one."""
        try:
            return timer.period.seconds(self.initial_parameters)
        except PeriodError:
            return None

    def parameter(self, name: str) -> Parameter | None:
        """Return the parameter called ``name``, or None."""
        return next((item for item in self.parameters if item.name.value == name), None)


@dataclass(frozen=True, slots=True)
class Endpoint:
    """``node.port`` as a connection names it."""

    text: Located[str]

    @property
    def node(self) -> str:
        """The part before the last dot."""
        return self.text.value.rpartition(".")[0]

    @property
    def port(self) -> str:
        """The part after the last dot."""
        return self.text.value.rpartition(".")[2]


@dataclass(frozen=True, slots=True)
class Connection:
    """A declared topic, service or action with its ports.

    ``sources`` are publishers or servers, ``sinks`` subscriptions or clients.
    """

    kind: ChannelKind
    name: Located[str]
    sources: tuple[Endpoint, ...]
    sinks: tuple[Endpoint, ...]
    span: Span = field(compare=False)
    qos: Located[str] | None = None  # the profile's name, unless inline
    delivery: Located[Delivery] | None = None
    isolation: Located[Isolation] | None = None

    @property
    def ends(self) -> tuple[Endpoint, ...]:
        """The sources and the sinks."""
        return (*self.sources, *self.sinks)


@dataclass(frozen=True, slots=True)
class Chain:
    """A path of data: publishers, each with a subscription in the node of the next one.

    ``latency_ms`` is the maximum time from a message of the first to one of the last.
    """

    name: Located[str]
    through: tuple[Endpoint, ...]
    latency_ms: Located[float]
    span: Span = field(compare=False)


class ExecutorKind(StrEnum):
    """The kind of an executor."""

    EVENTS = "events"
    SINGLE_THREADED = "single_threaded"
    MULTI_THREADED = "multi_threaded"


#: The executor of nodes without one; it need not be declared.
DEFAULT_EXECUTOR = "default"


@dataclass(frozen=True, slots=True)
class Executor:
    """An executor for a group of nodes. ``threads`` applies to multi_threaded only.

    ``cpus`` are the CPUs that its threads may run on, numbered from 0 as in Linux; empty for all.
    ``priority`` is a SCHED_FIFO priority from 1 to 99 (man 7 sched); None for normal scheduling.
    """

    name: Located[str]
    kind: ExecutorKind
    span: Span = field(compare=False)
    threads: int = 2
    threads_span: Span | None = field(default=None, compare=False)  # None: not set
    cpus: tuple[int, ...] = ()
    priority: int | None = None


@dataclass(frozen=True, slots=True)
class NamedQos:
    """A profile declared in ``qos_profiles``."""

    name: Located[str]
    qos: Qos
    extends: Located[str] | None = None


@dataclass(frozen=True, slots=True)
class QosReference:
    """A reference to a profile by name, known or unknown."""

    name: Located[str]


@dataclass(frozen=True, slots=True)
class System:
    """Everything that a file declares.

    A node type that is validated alone is a system with that one node and ``node_type`` true:
    nothing outside it is known. ``supervision`` is the default for nodes; ``implied_dependencies``
    makes clients wait for their servers without ``depends_on``.
    """

    name: Located[str]
    source: SourceFile
    nodes: tuple[Node, ...]
    span: Span = field(compare=False)
    namespace: str = "/"  # absolute; default for nodes
    namespace_span: Span | None = field(default=None, compare=False)
    description: str = ""
    connections: tuple[Connection, ...] = ()
    chains: tuple[Chain, ...] = ()
    qos_profiles: tuple[NamedQos, ...] = ()
    qos_references: tuple[QosReference, ...] = ()
    executors: tuple[Executor, ...] = ()
    processes: tuple[Process, ...] = ()
    hosts: tuple[Host, ...] = ()
    discovery: Discovery | None = None
    autostart: PrimaryState = PrimaryState.ACTIVE
    supervision: Supervision = DEFAULT_SUPERVISION
    implied_dependencies: bool = True
    delivery: Delivery = Delivery.AUTO
    use_sim_time: bool = False  # for the manager node, and the default for nodes
    node_type: bool = False
    parameter_files: frozenset[SourceFile] = frozenset()  # those with values
    unmatched_parameters: tuple[UnmatchedParameters, ...] = ()
    unknown: tuple[UnknownKey, ...] = ()  # unknown names from the command line
    _nodes: dict[str, Node] = field(init=False, repr=False, compare=False)
    _computed: dict[object, Any] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_nodes", _by_name(self.nodes))
        object.__setattr__(self, "_computed", {})

    def computed(self, function: Callable[[System], T]) -> T:
        """Return ``function(self)``, which is computed once: a system does not change."""
        if function not in self._computed:
            self._computed[function] = function(self)
        return cast(T, self._computed[function])

    def node(self, name: str) -> Node | None:
        """Return the node with the given key in ``nodes``, or None."""
        return self._nodes.get(name)

    def port(self, endpoint: Endpoint) -> Port | None:
        """Return the port of an endpoint, or None."""
        node = self.node(endpoint.node)
        return node.port(endpoint.port) if node is not None else None
