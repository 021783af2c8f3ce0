"""The processes of a system."""

from __future__ import annotations

from collections.abc import Iterator

from composer.base.diagnostics import Diagnostic, Label, error, suggestion, warning
from composer.base.source import Located
from composer.model import Channel
from composer.model.names import topic_name_problem
from composer.rules.analysis.context import Context, is_unresolved
from composer.rules.analysis.subjects import NODES_OF_PROCESSES, earlier_errors, unknown_subjects
from composer.rules.executors import LOST_BETWEEN_PROCESSES
from composer.rules.references import UNKNOWN_NODE, unknown_names

CONFLICTING_PROCESS = error("RC479", "conflicting-process")
MANY_SERVICES = warning("RC488", "many-services")


def check_unknown_process(context: Context) -> Iterator[Diagnostic]:
    """Check the processes of nodes, and the nodes of processes."""
    system = context.system
    if context.is_partial:
        return
    named = (
        (f"node '{node.name}' runs in '{node.process}'", node.process) for node in system.nodes
    )
    yield from unknown_names(context, "process", named)
    nodes = [node.name.value for node in system.nodes]
    known = frozenset(nodes)
    for process in system.processes:
        for node_name in process.nodes:
            if node_name.value in known or is_unresolved(node_name.value):
                continue
            yield Diagnostic(
                UNKNOWN_NODE,
                f"process '{process.name}' names '{node_name}', which is not a node of this system",
                node_name.span,
                hint=suggestion(node_name.value, nodes),
                subjects=(
                    *unknown_subjects("node", node_name.value, nodes),
                    ("nodes of process", process.name.value),
                    NODES_OF_PROCESSES,
                ),
            )


def check_conflicting_process(context: Context) -> Iterator[Diagnostic]:
    """Check that the processes share no node, and that each has one."""
    system = context.system
    named: dict[str, Located[str]] = {}
    first: dict[str, tuple[str, Located[str]]] = {}
    for node in system.nodes:
        if node.process is not None:
            named[node.name.value] = node.process
    for process in system.processes:
        for node_name in process.nodes:
            known = first.setdefault(node_name.value, (process.name.value, node_name))
            other = named.get(node_name.value)
            if known[0] != process.name.value:
                where = known[1].span
                text = known[0]
            elif other is not None and other.value != process.name.value:
                where, text = other.span, other.value
            else:
                continue
            yield Diagnostic(
                CONFLICTING_PROCESS,
                f"node '{node_name}' is in the processes '{text}' and '{process.name}'",
                node_name.span,
                related=(Label(where, f"in '{text}'"),),
                hint="name it in one of them",
                relies_on=tuple(
                    (kind, name)
                    for name in (text, process.name.value)
                    for kind in ("process", "nodes of process")
                ),
            )
    used = {process.value for process in named.values()}
    known_names = {process.name.value for process in system.processes}
    has_others = not used <= known_names  # undeclared-name reports them
    for process in system.processes:
        problem = topic_name_problem(process.name.value)
        if problem is not None or "/" in process.name.value:
            what = problem or "contains '/'"
            yield Diagnostic(
                CONFLICTING_PROCESS, f"process '{process.name}' {what}", process.name.span
            )
        elif (
            not (process.nodes or process.name.value in used or has_others)
            and not context.once(earlier_errors).any
        ):
            yield Diagnostic(
                CONFLICTING_PROCESS,
                f"process '{process.name}' has no nodes",
                process.name.span,
                relies_on=(("process", process.name.value),),
            )


_DOMAIN, _DISCOVERY_RANGE = "ROS_DOMAIN_ID", "ROS_AUTOMATIC_DISCOVERY_RANGE"


def check_separate_process(context: Context) -> Iterator[Diagnostic]:
    """Check the variables that the processes set."""
    for process in context.system.processes:
        for name, value in process.environment:
            if name.value == _DOMAIN:
                yield Diagnostic(
                    CONFLICTING_PROCESS,
                    f"process '{process.name}' would be in a ROS domain of its own",
                    name.span,
                    hint=f"set {_DOMAIN} for 'compose run' instead, which all processes inherit",
                )
            elif name.value == _DISCOVERY_RANGE and value == "OFF":
                yield Diagnostic(
                    CONFLICTING_PROCESS,
                    f"process '{process.name}' would discover no other process",
                    name.span,
                    hint="remove it",
                )


def check_isolation_between_processes(context: Context) -> Iterator[Diagnostic]:
    """Check the connections with 'isolation', with all ports of their topics."""
    if all(connection.isolation is None for connection in context.system.connections):
        return
    channel_of = {end.key: channel for channel in context.channels for end in channel.ends}
    for connection in context.system.connections:
        if connection.isolation is None:
            continue
        ports = connection.ends
        found = [channel_of.get((end.node, end.port)) for end in ports]
        known = [channel for channel in found if channel is not None]
        if len(known) < len(found) or not known or any(map(_has_pair_in_process, known)):
            continue
        if not all(channel.sources and channel.sinks for channel in known):
            continue
        yield Diagnostic(
            LOST_BETWEEN_PROCESSES,
            f"'isolation' of '{connection.name}' has no effect: no two of its nodes are in the "
            "same process",
            connection.isolation.span,
            hint="assign them to one process, or remove 'isolation'",
        )


def _has_pair_in_process(channel: Channel) -> bool:
    """Return whether messages of the channel may stay in a process."""
    return any(
        source.node.implementation.in_process
        and sink.node.implementation.in_process
        and source.node.process == sink.node.process
        for source in channel.sources
        for sink in channel.sinks
    )


#: Of about 180 nodes with all services.
_MOST_ENDPOINTS = 5000


def check_many_services(context: Context) -> Iterator[Diagnostic]:
    """Check the services of nodes if they are in several processes."""
    system = context.system
    if not system.processes:
        return
    found = [
        node.introspection.endpoints for node in system.nodes if node.implementation.in_process
    ]
    if sum(found) > _MOST_ENDPOINTS:
        yield Diagnostic(
            MANY_SERVICES,
            f"the nodes have about {sum(found)} endpoints for tools: their processes may not start "
            "within the time limit",
            system.name.span,
            hint="disable what no tool uses, in 'introspection' of the system",
        )
