"""The processes of a system, each with some of its nodes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from typing import TYPE_CHECKING

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, Span
from composer.model.supervision import OnFailure

if TYPE_CHECKING:
    from composer.model.supervision import Supervision
    from composer.model.system import Node, PrimaryState, System

#: ROS reads from it in which enclave a process is.
ENCLAVE_VARIABLE = "ROS_SECURITY_ENCLAVE_OVERRIDE"


@dataclass(frozen=True, slots=True)
class Process:
    """A process with nodes of the system.

    ``nodes`` are the nodes that it names; a node may also name its process itself. ``cpus`` and
    ``priority`` are as for executors, and apply to all of its threads. If it uses more than
    ``memory_mb`` of memory, it fails. Without a ``host``, it runs on the computer of the system.
    """

    name: Located[str]
    span: Span = field(compare=False)
    nodes: tuple[Located[str], ...] = ()
    cpus: tuple[int, ...] = ()
    priority: int | None = None
    environment: tuple[tuple[Located[str], str], ...] = ()
    memory_mb: Located[float] | None = None
    host: Located[str] | None = None


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


def own_enclave(environment: Mapping[str, str], full_name: str) -> dict[str, str]:
    """Return the variable for a process of a system, if ``environment`` sets an enclave at all.

    As in the policy that ``compose export sros2`` writes, the enclave of a process is its full
    name.
    """
    return {ENCLAVE_VARIABLE: full_name} if environment.get(ENCLAVE_VARIABLE) else {}


def _located(node: Node, goal: PrimaryState | None) -> Located[PrimaryState] | None:
    return None if goal is None else node.name.map(lambda _: goal)


def _ignored(supervision: Supervision) -> Located[OnFailure] | None:
    return supervision.on_failure if supervision.policy is OnFailure.IGNORE else None
