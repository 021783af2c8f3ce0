"""What implements a node: a behavior, a class, an executable, or something outside the system."""

from __future__ import annotations

from dataclasses import field
from enum import StrEnum
from pathlib import Path

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, Span
from composer.language.tree import Plain

#: Default time in milliseconds until the ports of an executable or external node must be there.
DEFAULT_READY_TIMEOUT_MS = 10_000.0


class ImplementationKind(StrEnum):
    """What implements a node."""

    DECLARATIVE = "declarative"  # reactions in YAML only
    BEHAVIOR = "behavior"
    CLASS = "class"
    EXECUTABLE = "executable"
    COMPONENT = "component"
    EXTERNAL = "external"

    @property
    def in_process(self) -> bool:
        """Whether the node runs in the process of the composer."""
        return self not in _OUTSIDE

    @property
    def declares_everything(self) -> bool:
        """Whether the node was written for the composer: it only has what it declares."""
        return self in (ImplementationKind.BEHAVIOR, ImplementationKind.DECLARATIVE)


_OUTSIDE = (
    ImplementationKind.EXECUTABLE,
    ImplementationKind.COMPONENT,
    ImplementationKind.EXTERNAL,
)


class ExecutableKind(StrEnum):
    """When an executable has started successfully."""

    NODE = "node"  # once its declared ports are in the ROS graph
    TASK = "task"  # once it has exited with status 0


class LifecycleKind(StrEnum):
    """Whether a node outside the process is driven by its lifecycle services."""

    NONE = "none"
    MANAGED = "managed"


@dataclass(frozen=True, slots=True)
class BehaviorReference:
    """``module:Class``: Python next to the YAML file or the node types, or installed."""

    text: Located[str]
    folder: Path  # the folder of the YAML file; searched first
    node_folders: tuple[Path, ...] = ()  # the folders of node types; searched next

    @property
    def module(self) -> str:
        """The part before the colon."""
        return self.text.value.partition(":")[0]

    @property
    def class_name(self) -> str:
        """The part after the colon, or an empty text."""
        return self.text.value.partition(":")[2]


@dataclass(frozen=True, slots=True)
class HostedClass:
    """An rclpy node class that runs in the process, and the arguments of its constructor."""

    reference: BehaviorReference
    arguments: tuple[tuple[Located[str], Plain], ...] = ()


@dataclass(frozen=True, slots=True)
class Outside:
    """An implementation outside the process.

    ``ready_timeout_ms`` is the time limit until the node is in the ROS graph with its ports.
    """

    span: Span = field(compare=False)
    lifecycle: LifecycleKind = field(default=LifecycleKind.NONE, kw_only=True)
    ready_timeout_ms: Located[float] | None = field(default=None, kw_only=True)

    @property
    def is_managed(self) -> bool:
        """Whether the lifecycle services of the node drive it."""
        return self.lifecycle is LifecycleKind.MANAGED

    @property
    def ready_timeout_s(self) -> float:
        """The time limit of the start, in seconds."""
        limit = self.ready_timeout_ms
        return (DEFAULT_READY_TIMEOUT_MS if limit is None else limit.value) / 1000.0


@dataclass(frozen=True, slots=True)
class Executable(Outside):
    """A program that runs as a child process.

    It is found by ``package`` and ``name``, as with ``ros2 run``, or started by ``command``; a
    relative ``working_directory`` is below ``folder``, that of the YAML file. A process that does
    not end after SIGINT gets SIGTERM after ``sigterm_timeout_ms``, and SIGKILL after another
    ``sigkill_timeout_ms``.

    ``nodes`` are the names of the nodes that the program creates: the first is that of its entry in
    the system, and the program keeps all of them unless the entry has a ``name``. If ``nodes`` is
    empty, the names are not known. None: the program creates one node, which gets the name of the
    entry.
    """

    folder: Path
    package: Located[str] | None = None
    name: Located[str] | None = None
    command: tuple[Located[str], ...] = ()
    arguments: tuple[Located[str], ...] = ()
    nodes: tuple[Located[str], ...] | None = None
    environment: tuple[tuple[Located[str], str], ...] = ()
    working_directory: Located[str] | None = None
    kind: ExecutableKind = ExecutableKind.NODE
    sigterm_timeout_ms: float = 500.0
    sigkill_timeout_ms: float = 300.0
    given: tuple[Located[str], ...] = field(default=(), compare=False)  # the keys in YAML

    def __str__(self) -> str:
        if self.command:
            return " ".join(word.value for word in self.command)
        return f"{self.package or '?'}/{self.name or '?'}"


@dataclass(frozen=True, slots=True)
class Component(Outside):
    """A class of a package that a component container loads as a node.

    ``extra_arguments`` are for the container, such as ``use_intra_process_comms``.
    """

    package: Located[str] | None = None
    plugin: Located[str] | None = None
    extra_arguments: tuple[tuple[Located[str], Plain], ...] = ()

    def __str__(self) -> str:
        return f"{self.package or '?'} {self.plugin or '?'}"


@dataclass(frozen=True, slots=True)
class External(Outside):
    """A node that is started by something else: the system waits for it and observes it."""
