"""The ports and nodes that connections, chains, reactions and dependencies name."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

from composer.base.diagnostics import Diagnostic, Label, Subject, error, suggestion
from composer.base.source import Located
from composer.model import DEFAULT_EXECUTOR, Connection, Endpoint, Node, System
from composer.rules.analysis.context import Context, is_unresolved, location, part_of
from composer.rules.analysis.expressions import SENDERS, sends
from composer.rules.analysis.formatting import a
from composer.rules.analysis.subjects import (
    NAMESPACES,
    PORT_SECTIONS,
    connection_subjects,
    earlier_errors,
    unknown_subjects,
)

UNKNOWN_NODE = error("RC202", "unknown-node")
UNKNOWN_PORT = error("RC203", "unknown-port")
UNDECLARED_NAME = error("RC205", "undeclared-name")
PORT_CONNECTED_TWICE = error("RC212", "port-connected-twice")
_SECTIONS = {"node": "nodes", "executor": "executors", "process": "processes", "host": "hosts"}


def endpoints(system: System) -> Iterator[tuple[Endpoint, Connection | None]]:
    """Yield the ports that connections and chains refer to, with their connection."""
    for connection in system.connections:
        yield from ((end, connection) for end in connection.ends)
    for chain in system.chains:
        yield from ((end, None) for end in chain.through)


class Absence(NamedTuple):
    """Why a name is not in a section of a system: the end of a message, with labels and a hint."""

    text: str
    labels: tuple[Label, ...] = ()
    hint: str | None = None


def absence(system: System, section: str, name: str, noun: str) -> Absence:
    """Return why ``name`` is not there: a condition leaves it out, or nothing declares it."""
    left_out = system.left_out_entry(section, name)
    if left_out is None:
        return Absence(f"which is not {noun} of this system")
    text = f"which its '{left_out.key}' leaves out"
    labels = (Label(left_out.span, "left out here"),)
    condition = f"'{left_out.key}: {left_out.condition}'"
    if "'" in left_out.condition:
        condition = f'{left_out.key}: "{left_out.condition}"'
    hint = f"write {condition} here too, or remove the condition" if left_out.condition else None
    return Absence(text, labels, hint)


def declared(context: Context) -> Mapping[str, Mapping[str, None]]:
    """Return the names of what a system declares, in order, by kind."""
    system = context.system
    executors = (*(executor.name.value for executor in system.executors), DEFAULT_EXECUTOR)
    return {
        "node": dict.fromkeys(node.name.value for node in system.nodes),
        "executor": dict.fromkeys(executors),
        "process": dict.fromkeys(process.name.value for process in system.processes),
        "host": dict.fromkeys(host.name.value for host in system.hosts),
    }


def unknown_name(context: Context, kind: str, message: str, name: Located[str]) -> Diagnostic:
    """Return a diagnostic that begins with ``message``, and says why there is no such name."""
    known = context.once(declared)[kind]
    why = absence(context.system, _SECTIONS[kind], name.value, a(kind))
    return Diagnostic(
        UNKNOWN_NODE if kind == "node" else UNDECLARED_NAME,
        f"{message}, {why.text}",
        name.span,
        why.labels,
        why.hint or suggestion(name.value, known),
        subjects=unknown_subjects(kind, name.value, known),
    )


def unknown_names(
    context: Context, kind: str, named: Iterable[tuple[str, Located[str] | None]]
) -> Iterator[Diagnostic]:
    """Report the names that nothing declares; each comes after the first half of its message."""
    known = context.once(declared)[kind]
    for message, name in named if not context.is_partial else ():
        if name is not None and name.value not in known and not is_unresolved(name.value):
            yield unknown_name(context, kind, message, name)


def _names_given(context: Context, connection: Connection | None) -> tuple[Subject, ...]:
    """Return what is not known of a connection that names the wrong port."""
    return () if connection is None else connection_subjects(context.system, connection)


def check_unknown_node(context: Context) -> Iterator[Diagnostic]:
    """Check the endpoints of connections, the dependencies of nodes, and the command line."""
    if context.is_partial:
        return
    for endpoint, connection in endpoints(context.system):
        yield from _node_of_endpoint(context, endpoint, connection)
    yield from unknown_names(context, "node", _dependencies(context))
    for unknown in context.system.unknown:
        why = absence(context.system, "nodes", unknown.name.value, "a node")
        message = f"'{unknown.name}' is not a node of this system"
        yield Diagnostic(
            UNKNOWN_NODE,
            f"'{unknown.name}' names a node {why.text}" if why.labels else message,
            unknown.name.span,
            why.labels,
            None if why.labels else suggestion(unknown.name.value, unknown.known),
            subjects=unknown_subjects("node", unknown.name.value, unknown.known),
        )


def _node_of_endpoint(
    context: Context, endpoint: Endpoint, connection: Connection | None
) -> Iterator[Diagnostic]:
    name = endpoint.node
    if is_unresolved(endpoint.text.value) or context.system.node(name) is not None:
        return
    names = _names_given(context, connection)
    if not name:
        message = f"'{endpoint.text}' is not of the form 'node.port'"
        yield Diagnostic(UNKNOWN_NODE, message, endpoint.text.span, subjects=names)
        return
    message = f"'{endpoint.text}' names node '{name}'"
    at = Located(name, part_of(endpoint.text, 0, len(name)))
    unknown = unknown_name(context, "node", message, at)
    yield replace(unknown, subjects=(*unknown.subjects, *names))


def _dependencies(context: Context) -> Iterator[tuple[str, Located[str]]]:
    """Yield the nodes that nodes depend on, after the first half of a message about them."""
    for node in context.system.nodes:
        for dependency in node.depends_on:
            verb = "has the container" if dependency.is_container else "depends on"
            yield f"node '{node.name}' {verb} '{dependency.node}'", dependency.node


def check_unknown_port(context: Context) -> Iterator[Diagnostic]:
    """Check the ports that connections, chains, reactions and overrides refer to."""
    errors = context.once(earlier_errors)
    for endpoint, connection in endpoints(context.system):
        if not errors.may_declare(endpoint.node, *PORT_SECTIONS):
            yield from _port_of_endpoint(context, endpoint, connection)
    for site, key, send in sends(context.system):
        name = send.port
        if not site.node.complete or is_unresolved(name.value):
            continue
        if errors.may_declare(site.node.name.value, *PORT_SECTIONS):
            continue
        if site.node.port(name.value) is not None:
            continue
        candidates = [port.name.value for port in site.node.ports_of(*SENDERS[key])]
        yield Diagnostic(
            UNKNOWN_PORT,
            f"'{key}' names port '{name}', which the node does not have",
            name.span,
            hint=suggestion(name.value, candidates),
            subjects=_renamed(site.node, name.value, candidates),
        )
    for node in context.system.nodes:
        yield from _overridden_ports(node)


def _renamed(node: Node, name: str, candidates: Iterable[str]) -> tuple[Subject, ...]:
    """Return a port that does not exist: other nodes of the type may name it, too."""
    return (("renamed port", f"{name} {' '.join(candidates)}"), ("port", f"{node.name}.{name}"))


def _port_of_endpoint(
    context: Context, endpoint: Endpoint, connection: Connection | None
) -> Iterator[Diagnostic]:
    node = context.system.node(endpoint.node)
    if node is None or not node.complete or node.port(endpoint.port) is not None:
        return
    name = endpoint.port
    if is_unresolved(endpoint.text.value):
        return
    candidates = [port.name.value for port in node.ports]
    names = _names_given(context, connection)
    is_in_loop = "${" in endpoint.text.span.text
    yield Diagnostic(
        UNKNOWN_PORT,
        f"node '{node.name}' has no port '{name}'",
        part_of(endpoint.text, len(endpoint.node) + 1, len(name)),
        hint=suggestion(name, candidates),
        subjects=(*_renamed(node, name, candidates), *names),
        # One wrong value of a loop gives an unknown node and an unknown port.
        relies_on=(("port", f"{node.name}.{name}"), *(names if is_in_loop else ())),
    )


def _overridden_ports(node: Node) -> Iterator[Diagnostic]:
    for unknown in node.unknown:
        if unknown.section not in PORT_SECTIONS:
            continue
        name = unknown.name
        other = node.port(name.value)
        hint = (
            f"'{name}' is declared under '{other.kind.section}'"
            if other is not None
            else suggestion(name.value, unknown.known)
        )
        yield Diagnostic(
            UNKNOWN_PORT,
            f"node type '{node.type_name}' has no port '{name}' under '{unknown.section}'",
            name.span,
            hint=hint,
            subjects=_renamed(node, name.value, unknown.known),
        )


def check_port_connected_twice(context: Context) -> Iterator[Diagnostic]:
    """Compare each later connection of a port with its first one."""
    first: dict[str, tuple[Connection, Endpoint]] = {}
    reported: set[tuple[str, int, int]] = set()  # a pattern stands for several ports
    for connection in context.system.connections:
        for endpoint in connection.ends:
            if context.system.port(endpoint) is None or is_unresolved(endpoint.text.value):
                continue
            if is_unresolved(connection.name.value):
                continue
            earlier, place = first.setdefault(endpoint.text.value, (connection, endpoint))
            difference = _difference(earlier, connection)
            later = location(endpoint.text.span)
            if place is not endpoint and _is_named_twice(place, endpoint, connection):
                yield Diagnostic(
                    PORT_CONNECTED_TWICE,
                    f"port '{endpoint.text}' is named twice",
                    endpoint.text.span,
                    (Label(place.text.span, "here too"),),
                    "did you mean another port?",
                    connection_subjects(context.system, connection, endpoint),
                    _twice(endpoint),
                )
            elif difference is not None and later not in reported:
                reported.add(later)
                yield Diagnostic(
                    PORT_CONNECTED_TWICE,
                    f"port '{endpoint.text}' is connected twice, with {difference}",
                    endpoint.text.span,
                    (Label(place.text.span, f"connected to '{earlier.name}' here"),),
                    "put all ports that share a name into one connection",
                    (
                        *connection_subjects(context.system, earlier),
                        *connection_subjects(context.system, connection, endpoint),
                    ),
                    _twice(endpoint),
                )


def _twice(endpoint: Endpoint) -> tuple[Subject, ...]:
    """Return what a port that is connected twice relies on: that this port is meant."""
    name = endpoint.text.value
    return (*NAMESPACES, ("port", name), ("type", name))


def _is_named_twice(first: Endpoint, second: Endpoint, connection: Connection) -> bool:
    """Return whether one connection names a port twice, both times without a pattern."""
    written = {first.text.span.text, second.text.span.text}
    is_within = any(end is first for end in connection.ends)
    is_elsewhere = location(first.text.span) != location(second.text.span)
    return is_within and is_elsewhere and written == {second.text.value}


def _difference(earlier: Connection, later: Connection) -> str | None:
    if earlier.kind is not later.kind:
        return None  # the wrong kind of port is reported by another rule
    if earlier.name.value.lstrip("/") != later.name.value.lstrip("/"):
        return f"the names '{earlier.name}' and '{later.name}'"
    if earlier.qos is not None and later.qos is not None and earlier.qos != later.qos:
        return f"the QoS profiles '{earlier.qos}' and '{later.qos}'"
    return None
