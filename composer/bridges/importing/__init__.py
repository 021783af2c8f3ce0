"""Describes existing nodes, and writes the descriptions as systems and node types.

A description comes from the ROS graph (:mod:`.live`), from the source of a class
(:mod:`.python_class`) or from a launch file (:mod:`composer.launch`). Nothing here imports
ROS or runs the code of users.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from composer.base.fast_dataclass import dataclass
from composer.language.tree import Plain
from composer.model import PortKind
from composer.model.names import join_node_name
from composer.model.qos import QosProfile


@dataclass(frozen=True, slots=True)
class FoundPort:
    """A port of a node. ``name`` is its ROS name: absolute, relative or private.

    ``qos`` is None if it is not known, and for services and actions. ``external`` says that the
    other endpoints are not in the same file. ``comments`` are written above the port.
    """

    kind: PortKind
    name: str
    type: str
    qos: QosProfile | None = None
    external: bool = False
    comments: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class FoundParameter:
    """A parameter of a node. ``settings`` are further keys of its declaration."""

    name: str
    type: str
    value: Plain = None
    settings: Mapping[str, Plain] = field(default_factory=dict)
    comments: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class FoundNode:
    """A node. ``keys`` are those that say what implements it, such as ``external``.

    ``namespace`` is absolute. Of the nodes with one full name, only one is there at a time; each
    has a ``version``. ``container`` is the full name and the version of the node that loads it.
    """

    name: str
    namespace: str = "/"
    keys: Mapping[str, Plain] = field(default_factory=dict)
    ports: tuple[FoundPort, ...] = ()
    parameters: tuple[FoundParameter, ...] = ()
    remappings: Mapping[str, str] = field(default_factory=dict)
    comments: tuple[str, ...] = ()
    container: tuple[str, tuple[int, ...]] | None = None
    version: tuple[int, ...] = (0,)

    @property
    def full_name(self) -> str:
        """The full name of the node in ROS."""
        return join_node_name(self.namespace, self.name)


@dataclass(frozen=True, slots=True)
class FoundSystem:
    """Nodes that belong together. ``left_out`` says what could not be described, and why.

    ``sections`` are parameters of further nodes, by their full names. ``arguments`` are the
    declarations of arguments.
    """

    name: str
    nodes: tuple[FoundNode, ...]
    comments: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    sections: Mapping[str, Mapping[str, Plain]] = field(default_factory=dict)
    arguments: Mapping[str, Plain] = field(default_factory=dict)
