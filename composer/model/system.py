"""The system: nodes, connections, chains, executors, and what it records of itself.

A process of a system has a part of it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace
from enum import StrEnum
from typing import Any, TypeVar, cast

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, SourceFile, Span
from composer.language.tree import LeftOut
from composer.model.hosts import Discovery, Host, Process
from composer.model.names import matches_wildcard
from composer.model.node import (
    DEFAULT_SUPERVISION,
    Node,
    OnFailure,
    PrimaryState,
    Supervision,
    UnknownKey,
    by_name,
)
from composer.model.ports import ChannelKind, Delivery, Isolation, Port, Qos

#: The end of the topic with the requests and responses of a service: ROS 2's introspection.
EVENT_TOPIC = "_service_event"
T = TypeVar("T")
#: The executor of nodes without one; declaring it is optional.
DEFAULT_EXECUTOR = "default"


def owner_of_topic(topic: str) -> tuple[str, str]:
    """Return what a topic belongs to: the kind, and the name of the topic, service or action.

    The kind is a key of ``recording``: ``topics``, ``services`` or ``actions``.
    """
    action, separator, _ = topic.partition("/_action/")
    if separator:
        return "actions", action
    service = topic.removesuffix(f"/{EVENT_TOPIC}")
    return ("topics" if service == topic else "services"), service


def is_chosen(topic: str, patterns: Mapping[str, Sequence[str]]) -> bool:
    """Return whether a topic matches the patterns of its kind; without any patterns, it does."""
    kind, name = owner_of_topic(topic)
    if not any(patterns.values()):
        return True
    return any(matches_wildcard(pattern, name) for pattern in patterns[kind])


@dataclass(frozen=True, slots=True)
class Recording:
    """The ``recording`` of a system.

    ``topics``, ``services``, ``actions`` and ``exclude`` are patterns of full names; without the
    first three, everything is recorded. ``ring_s`` makes it a flight recorder: it keeps the last
    seconds, and writes them after a fault. A new file begins before one is larger than ``split_mb``
    or longer than ``split_s``.
    """

    folder: str = "bags"
    topics: tuple[Located[str], ...] = ()
    services: tuple[Located[str], ...] = ()
    actions: tuple[Located[str], ...] = ()
    exclude: tuple[Located[str], ...] = ()
    ring_s: float | None = None
    split_mb: float | None = None
    split_s: float | None = None

    @property
    def patterns(self) -> Mapping[str, tuple[Located[str], ...]]:
        """The patterns of what is recorded, by kind."""
        return {"topics": self.topics, "services": self.services, "actions": self.actions}

    def includes(self, topic: str) -> bool:
        """Return whether a topic is recorded, by its full name."""
        _, name = owner_of_topic(topic)
        if any(matches_wildcard(pattern.value, name) for pattern in self.exclude):
            return False
        kinds = self.patterns.items()
        return is_chosen(topic, {kind: [item.value for item in found] for kind, found in kinds})


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
    recording: Recording | None = None
    autostart: PrimaryState = PrimaryState.ACTIVE
    supervision: Supervision = DEFAULT_SUPERVISION
    implied_dependencies: bool = True
    delivery: Delivery = Delivery.AUTO
    use_sim_time: bool = False  # for the manager node, and the default for nodes
    node_type: bool = False
    parameter_files: frozenset[SourceFile] = frozenset()  # those with values
    unmatched_parameters: tuple[UnmatchedParameters, ...] = ()
    unknown: tuple[UnknownKey, ...] = ()  # unknown names from the command line
    arguments: tuple[str, ...] = field(default=(), compare=False)  # given, as name=value
    left_out: tuple[LeftOut, ...] = field(default=(), compare=False)  # by conditions
    _nodes: dict[str, Node] = field(init=False, repr=False, compare=False)
    _computed: dict[object, Any] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_nodes", by_name(self.nodes))
        object.__setattr__(self, "_computed", {})

    def computed(self, function: Callable[[System], T]) -> T:
        """Return ``function(self)``, which is computed once: a system does not change."""
        if function not in self._computed:
            self._computed[function] = function(self)
        return cast("T", self._computed[function])

    def node(self, name: str) -> Node | None:
        """Return the node with the given key in ``nodes``, or None."""
        return self._nodes.get(name)

    def left_out_entry(self, section: str, name: str) -> LeftOut | None:
        """Return what leaves an entry of a section out; None if no condition does."""
        for item in self.left_out:
            if item.section == section and matches_wildcard(item.name, name):
                return item
        return None

    def port(self, endpoint: Endpoint) -> Port | None:
        """Return the port of an endpoint, or None."""
        node = self.node(endpoint.node)
        return node.port(endpoint.port) if node is not None else None

    def without_nodes(self, patterns: Sequence[str]) -> System:
        """Return the system without the nodes whose keys match; nothing waits for them.

        Chains through these nodes are left out, too.
        """
        removed = {
            name
            for name in self._nodes
            if any(matches_wildcard(pattern, name) for pattern in patterns)
        }
        if not removed:
            return self
        nodes = (
            replace(
                node,
                depends_on=tuple(
                    item for item in node.depends_on if item.node.value not in removed
                ),
            )
            for node in self.nodes
            if node.name.value not in removed
        )
        chains = (
            chain
            for chain in self.chains
            if not any(point.node in removed for point in chain.through)
        )
        return replace(self, nodes=tuple(nodes), chains=tuple(chains))


def member_system(
    system: System, process: str, goals: Mapping[str, PrimaryState] | None = None
) -> System:
    """Return the part of a system that one of its processes runs, as a system of its own.

    The process that runs the whole system coordinates it: it decides when nodes of this part are
    brought up, and how their failures are handled. So they have no dependencies here, stay
    unconfigured at first, and are only taken down if they fail, unless that is to be ignored.
    ``goals`` are the states in which nodes of the whole system start: the highest that the
    coordinating process brings them to.
    """
    limits = goals or {}
    nodes = tuple(
        replace(
            node,
            process=None,
            depends_on=(),
            autostart=_located(node, limits.get(node.name.value)),
            supervision=replace(node.supervision, on_failure=_ignored(node.supervision)),
            required=True,
        )
        for node in system.nodes
        if node.process is not None and node.process.value == process
    )
    discovery = system.discovery and replace(system.discovery, start=False)
    return replace(
        system,
        discovery=discovery,
        name=system.name.map(lambda name: f"{name}/{process}"),
        nodes=nodes,
        connections=(),
        implied_dependencies=False,
        supervision=replace(system.supervision, on_failure=None),
        processes=(),
    )


def _located(node: Node, goal: PrimaryState | None) -> Located[PrimaryState] | None:
    return None if goal is None else node.name.map(lambda _: goal)


def _ignored(supervision: Supervision) -> Located[OnFailure] | None:
    return supervision.on_failure if supervision.policy is OnFailure.IGNORE else None
