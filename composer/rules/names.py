"""Names that are not valid in ROS, that collide, or that surprise."""

from __future__ import annotations

from collections.abc import Iterator

from composer.base.diagnostics import Diagnostic, Label, error, info, warning
from composer.base.source import Located, Span
from composer.language.rules import DUPLICATE_NAME
from composer.model import Connection, Node, Port, System
from composer.model.names import (
    MAXIMUM_NAMESPACE_LENGTH,
    free_name,
    is_hidden,
    join,
    namespace_problem,
    node_name_problem,
    parameter_name_problem,
    remapped_name,
    topic_name_problem,
)
from composer.model.qos_overrides import PREFIX as QOS_OVERRIDES
from composer.rules.analysis.context import Context, is_unresolved, location
from composer.rules.analysis.formatting import a, safe_name
from composer.rules.analysis.subjects import connection_subjects, namespace_subjects

INVALID_NAME = error("RC221", "invalid-name")
DEEP_NAMESPACE = warning("RC231", "deep-namespace")
HIDDEN_NAME = info("RC232", "hidden-name")
_MAX_LEVELS = 3


def check_invalid_node_name(context: Context) -> Iterator[Diagnostic]:
    """Check the names of nodes, and of inner nodes, which may be in a namespace."""
    names = {node.ros_name.value for node in context.system.nodes}
    for node in context.system.nodes:
        yield from _check_node_name(node.ros_name, names)
        listed = node.executable.nodes if node.executable is not None else None
        for name in listed or ():
            for part in (
                name.value.removeprefix("/").split("/") if name is not node.own_name else ()
            ):
                yield from _check_node_name(Located(part, name.span), names)


def _check_node_name(name: Located[str], names: set[str]) -> Iterator[Diagnostic]:
    problem = node_name_problem(name.value)
    if problem is not None and not is_unresolved(name.value):
        better = free_name(safe_name(name.value), names)
        names.add(better)
        message = f"node name '{name}' {problem}"
        yield Diagnostic(INVALID_NAME, message, name.span, hint=f"rename it to '{better}'")


def check_invalid_namespace(context: Context) -> Iterator[Diagnostic]:
    """Check the namespaces of the system and its nodes; a shared one is reported once."""
    yield from _invalid_system_name(context.system)
    system = context.system
    namespaces = [node.namespace for node in system.nodes]
    if system.namespace_span is not None:
        namespaces.append(Located(system.namespace, system.namespace_span))
    found = {
        location(namespace.span): namespace
        for namespace in namespaces
        if namespace_problem(namespace.value) is not None and not is_unresolved(namespace.value)
    }
    inside: dict[str, list[Node]] = {namespace.value: [] for namespace in found.values()}
    for node in system.nodes:
        for outer in (node.namespace.value, *_outer(node.namespace.value)):
            inside.get(outer, []).append(node)
    for namespace in found.values():
        if not any(outer in inside for outer in _outer(namespace.value)):
            problem = namespace_problem(namespace.value)
            yield Diagnostic(
                INVALID_NAME,
                f"namespace '{namespace}' {problem}",
                namespace.span,
                subjects=tuple(namespace_subjects(inside[namespace.value])),
            )
            inside[namespace.value] = []  # one diagnostic says which names are not known


def _outer(namespace: str) -> Iterator[str]:
    """Yield the namespaces around a namespace that have a possible length."""
    outer = namespace[: MAXIMUM_NAMESPACE_LENGTH + 1]
    while outer := outer.rpartition("/")[0]:
        yield outer


def _invalid_system_name(system: System) -> Iterator[Diagnostic]:
    name = system.name
    if system.node_type or is_unresolved(name.value):
        return
    problem = node_name_problem(name.value)
    if problem is None and namespace_problem(system.namespace) is None:
        problem = namespace_problem(join(system.namespace, name.value))
    if problem is not None:
        valid = safe_name(name.value)
        hint = f"rename it to '{valid}'" if valid != name.value else None
        yield Diagnostic(INVALID_NAME, f"system name '{name}' {problem}", name.span, hint=hint)


def check_invalid_ros_name(context: Context) -> Iterator[Diagnostic]:
    """Check the names of ports, of connections, and in remappings."""
    for kind, name, connection in _ros_names(context):
        problem = topic_name_problem(name.value)
        if problem is not None and not is_unresolved(name.value):
            yield Diagnostic(
                INVALID_NAME,
                f"{kind} name '{name}' {problem}",
                name.span,
                subjects=()
                if connection is None
                else connection_subjects(context.system, connection),
            )


def _ros_names(context: Context) -> Iterator[tuple[str, Located[str], Connection | None]]:
    for node in context.system.nodes:
        for port in node.ports:
            yield port.kind.channel, port.ros_name, None
        is_rule_of_rcl = not node.implementation.declares_everything
        for remapping in node.remappings:
            source = remapping.source.map(remapped_name if is_rule_of_rcl else str)
            yield "remapped", source, None
            yield "remapped", remapping.target, None
    for connection in context.system.connections:
        if not connection.name.value.startswith("~"):
            yield connection.kind.value, connection.name, connection


def check_invalid_parameter_name(context: Context) -> Iterator[Diagnostic]:
    """Check the name of every declared parameter. rcl passes any name on to other nodes."""
    for node in context.system.nodes:
        if node.gets_undeclared:
            continue
        names = {parameter.name.value for parameter in node.parameters}
        for parameter in node.parameters:
            name = parameter.name
            if name.value.startswith(QOS_OVERRIDES):
                continue  # it has the name of a topic
            problem = parameter_name_problem(name.value)
            if problem is not None and not is_unresolved(name.value):
                safe = ".".join(safe_name(part) for part in name.value.split(".") if part)
                better = free_name(safe, names)
                names.add(better)
                message = f"parameter name '{name}' {problem}"
                yield Diagnostic(INVALID_NAME, message, name.span, hint=f"rename it to '{better}'")


def check_private_connection_name(context: Context) -> Iterator[Diagnostic]:
    """Check the names of connections."""
    for connection in context.system.connections:
        name = connection.name
        if name.value.startswith("~"):
            yield Diagnostic(
                INVALID_NAME,
                f"{connection.kind} '{name}' is private, but a connection is not part of a node",
                name.span,
                hint="use an absolute name, such as '/node/topic'",
            )


def check_duplicate_full_name(context: Context) -> Iterator[Diagnostic]:
    """Compare the full names of all nodes."""
    first: dict[str, tuple[Node, Span]] = {}
    for node in context.system.nodes:
        for name, span in _full_names(node):
            other, place = first.setdefault(name, (node, span))
            if other is not node and not is_unresolved(name):
                yield Diagnostic(
                    DUPLICATE_NAME,
                    f"nodes '{node.name}' and '{other.name}' both have the full name '{name}'",
                    span,
                    (Label(place, "the other node"),),
                    hint="set another 'name' or 'namespace'",
                    subjects=(("same node", node.name.value), ("same node", other.name.value)),
                )


def _full_names(node: Node) -> Iterator[tuple[str, Span]]:
    yield node.full_name, node.ros_name.span
    for name in node.inner_nodes:
        yield name, node.name.span


def check_duplicate_port_name(context: Context) -> Iterator[Diagnostic]:
    """Check for names that a node uses twice."""
    for node in context.system.nodes:
        first: dict[str, Port] = {}
        for port in node.ports:
            earlier = first.setdefault(port.name.value, port)
            if earlier is not port and not is_unresolved(port.name.value):
                yield Diagnostic(
                    DUPLICATE_NAME,
                    f"'{port.name}' names both {a(port.kind)} and {a(earlier.kind)} of one node",
                    port.name.span,
                    (Label(earlier.name.span, f"the {earlier.kind}"),),
                    "rename one of them",
                )


def check_deep_namespace(context: Context) -> Iterator[Diagnostic]:
    """Count the levels of every node's namespace."""
    for node in context.system.nodes:
        namespace = node.namespace
        levels = namespace.value.strip("/").count("/") + 1
        if (
            levels <= _MAX_LEVELS
            or is_unresolved(namespace.value)
            or namespace_problem(namespace.value)
        ):
            continue
        yield Diagnostic(
            DEEP_NAMESPACE,
            f"namespace '{namespace}' has {levels} levels, more than {_MAX_LEVELS}",
            namespace.span,
            hint="merge or drop levels that do not distinguish nodes",
        )


def check_hidden_name(context: Context) -> Iterator[Diagnostic]:
    """Check the names of nodes, ports and connections."""
    for word, name in _visible_names(context):
        if (
            is_hidden(name.value)
            and not is_unresolved(name.value)
            and not topic_name_problem(name.value)
        ):
            yield Diagnostic(
                HIDDEN_NAME,
                f"{word} '{name}' is hidden from ROS tools by its leading underscore",
                name.span,
            )


def _visible_names(context: Context) -> Iterator[tuple[str, Located[str]]]:
    for node in context.system.nodes:
        yield "node", node.ros_name
        for port in node.ports:
            yield port.kind.channel, port.ros_name
    for connection in context.system.connections:
        yield connection.kind.value, connection.name
