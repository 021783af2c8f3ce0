"""What diagnostics are about: what follows from another one is left out, repetitions are joined.

A diagnostic names the things that it says are wrong (``subjects``) and the things that it takes for
right (``relies_on``). If another rule reports one of the latter, the diagnostic may only follow
from that mistake. A thing has a kind and a name:

- ``node``, ``process``, ``executor``, ``QoS profile``, ``variable``, ``field``, ``package``,
  ``renamed port``: what does not exist, and what may be meant instead
- ``port``, ``type``: a port as connections name it ("planner.scan"), and its type, which other
  ports contradict; ``declared type``: by its place, which the class of the node contradicts
- ``topic qos``: the QoS of a topic; ``qos override``: of a port that a parameter overrides
- ``name``: that of a topic, service or action, or of the port that has it
- ``port name``, ``node name``, ``last part``: of ports that may be meant, in any node or namespace
- ``namespace``, ``same node``, ``behavior``: of a node; ``section``: of a parameter file
- ``parameter``, ``undeclared parameter``, ``key``, ``folder``: by its own name, wherever it is
- ``nodes of process``, ``parameter files``: what is in them
- ``file``, ``line``, ``errors``: all that is reported in a file or on a line, and the errors there
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterable, Iterator

from composer.base.diagnostics import (
    Diagnostic,
    Label,
    Severity,
    Subject,
    errors_subject,
    line_subject,
    nearest,
)
from composer.base.fast_dataclass import dataclass, replace
from composer.base.source import Span
from composer.interfaces import Interfaces
from composer.language.expressions import Expression
from composer.model import Connection, Endpoint, Node, Port, PortKind, System
from composer.model.names import join
from composer.rules.analysis.context import Context

#: Nodes may be in another namespace than was meant, because a key of an include is misspelled.
NAMESPACES: tuple[Subject, ...] = (("key", "namespace"), ("key", "prefix"))
#: A process may lack nodes, because it names what is not one.
NODES_OF_PROCESSES: Subject = ("nodes of processes", "")


#: The kinds of things of which one mistake has many uses, which are reported together.
_JOINED = frozenset(
    {"executor", "field", "node", "package", "process", "QoS profile", "renamed port", "variable"}
)
#: Names that are declared elsewhere. If several of one kind are unknown and resemble no other, a
#: file or a section is probably missing.
_DECLARED = {
    "executor": "an executor of this system",
    "node": "a node of this system",
    "process": "a process of this system",
    "QoS profile": "a QoS profile",
}
_MANY = 3
_MAX_UNKNOWN = 20  # further unknown names in the labels of one diagnostic
_MAX_PLACES = 3  # further uses in the labels of one diagnostic
_SEVERITIES = tuple(Severity)  # the most severe one first
PORT_SECTIONS = tuple(kind.section for kind in PortKind)
SECTIONS = (*PORT_SECTIONS, "parameters", "state", "timers", "transforms")
_NEARBY_LINES = 8


def unknown_subjects(kind: str, name: str, names: Iterable[str]) -> tuple[Subject, ...]:
    """Return a thing that does not exist, and the one that may be meant."""
    close = nearest(name, names)
    return ((kind, name),) if close is None else ((kind, name), (kind, close))


def package_subjects(interfaces: Interfaces, package: str) -> tuple[Subject, ...]:
    """Return the package that an interface or a module is of, if it is not known."""
    name = re.split(r"[/.]", package)[0]
    return () if name in interfaces.packages() else (("package", name),)


def port_subject(node: Node, port: Port, kind: str = "port") -> Subject:
    """Return a port, or its ``type`` or ``qos``."""
    return (kind, f"{node.name}.{port.name}")


def type_subject(port: Port) -> Subject:
    """Return the declared type of a port: several nodes may have it from one place."""
    return ("declared type", str(port.interface.span))


def wiring(node: Node, port: Port) -> tuple[Subject, ...]:
    """Return what the connections of a port rely on: its names, with the connection and without."""
    channel = port.kind.channel
    return (
        *_names_of_port(node, port),
        ("port name", f"{channel} {port.name}"),
        ("node name", f"{channel} {node.name}"),
        ("namespace", node.name.value),
        ("last part", port.full_name.rpartition("/")[2]),
    )


def used_parameters(value: object) -> tuple[Subject, ...]:
    """Return the parameters that an expression uses; none if ``value`` is not one."""
    paths = value.paths if isinstance(value, Expression) else ()
    names = (path.parts[1] for path in paths if path.root == "parameters" and len(path.parts) > 1)
    return tuple(("parameter", str(name)) for name in names)


def namespace_subjects(nodes: Iterable[Node]) -> Iterator[Subject]:
    """Yield what is not known if the namespaces of nodes are wrong.

    Ports of other nodes that only differ in their namespaces may be meant for theirs.
    """
    for node in nodes:
        yield ("namespace", node.name.value)
        yield ("section", node.ros_name.value)
        for port in node.ports:
            yield ("last part", port.full_name.rpartition("/")[2])


def connection_subjects(
    system: System, connection: Connection, *wrong: Endpoint
) -> tuple[Subject, ...]:
    """Return the names that are not known if the ends ``wrong`` of a connection are."""
    found: list[Subject] = [("name", join(system.namespace, connection.name.value))]
    for end in connection.ends:
        node, port = system.node(end.node), system.port(end)
        is_source = end in connection.sources
        is_right = port is not None and port.kind.is_source is is_source
        if node is not None and port is not None and is_right and end not in wrong:
            found += _names_of_port(node, port)
        else:  # another port of that name, or of that node, may be meant
            found.append(("port name", f"{connection.kind} {end.port}"))
            found.append(("node name", f"{connection.kind} {end.node}"))
    return tuple(found)


def _names_of_port(node: Node, port: Port) -> Iterator[Subject]:
    yield ("name", f"{node.name}.{port.name}")
    yield ("name", port.full_name)
    yield ("name", join(node.namespace.value, port.ros_name.value))  # without the connection


def without_consequences(
    found: list[Diagnostic], of_project: Iterable[Diagnostic] = ()
) -> list[Diagnostic]:
    """Leave out diagnostics that rely on what another rule reports, perhaps of the project."""
    rules: dict[Subject, set[str]] = {}
    for item in (*found, *of_project):
        is_error = item.severity is Severity.ERROR
        for subject in (*item.subjects, *([errors_subject(item.primary)] if is_error else ())):
            rules.setdefault(subject, set()).add(item.rule.code)
    return [
        item
        for item in found
        if not any(rules.get(subject, set()) - {item.rule.code} for subject in _relies_on(item))
    ]


def _relies_on(item: Diagnostic) -> Iterator[Subject]:
    yield from item.relies_on
    yield ("file", item.primary.file.path)
    yield line_subject(item.primary)


def joined(found: list[Diagnostic]) -> list[Diagnostic]:
    """Report what was probably renamed or removed in one place once, with all uses of it.

    The report is the first of the most severe ones, whatever the files are called.
    """
    groups: dict[Subject, list[Diagnostic]] = {}
    for item in found:
        if item.subjects and item.subjects[0][0] in _JOINED:
            groups.setdefault(item.subjects[0], []).append(item)
    kept: dict[int, Diagnostic] = {}
    for items in groups.values():
        first, *others = sorted(items, key=lambda item: _SEVERITIES.index(item.severity))
        labels = (Label(other.primary, "here too") for other in others[:_MAX_PLACES])
        kept[id(first)] = replace(first, related=(*first.related, *labels)) if others else first
    repeated = {id(item) for items in groups.values() for item in items} - kept.keys()
    return _with_one_of_many(
        [kept.get(id(item), item) for item in found if id(item) not in repeated]
    )


def _with_one_of_many(found: list[Diagnostic]) -> list[Diagnostic]:
    """Report many unknown names of one kind once, unless they resemble others."""
    unknown: dict[str, list[Diagnostic]] = {}
    for item in found:
        kinds = [kind for kind, _ in item.subjects if kind in _DECLARED]
        if len(kinds) == 1:
            unknown.setdefault(kinds[0], []).append(item)
    left_out: set[int] = set()
    first: dict[int, Diagnostic] = {}
    for kind, (item, *others) in unknown.items():
        if len(others) + 1 >= _MANY:
            left_out.update(map(id, others))
            labels = (
                Label(other.primary, f"'{other.subjects[0][1]}' is not {_DECLARED[kind]} either")
                for other in others[:_MAX_UNKNOWN]
            )
            first[id(item)] = replace(item, related=(*item.related, *labels))
    return [first.get(id(item), item) for item in found if id(item) not in left_out]


@dataclass(frozen=True, slots=True)
class EarlierErrors:
    """The parts of a system that contain errors of earlier stages.

    ``nodes`` are the keys of the nodes that contain one. ``elsewhere`` is true if another part of
    the system contains one, such as connections or profiles. ``misspelled`` are pairs of a node and
    a section (``publishers``) whose key is probably misspelled: its content is not in the model.
    """

    nodes: frozenset[str]
    elsewhere: bool
    misspelled: frozenset[tuple[str, str]] = frozenset()

    @property
    def any(self) -> bool:
        """Whether there is any earlier error."""
        return self.elsewhere or bool(self.nodes)

    def may_declare(self, node: str, *sections: str) -> bool:
        """Return whether a section of a node may declare more than the model contains."""
        return bool(self.misspelled) and not self.misspelled.isdisjoint(
            (node, section) for section in sections
        )


def earlier_errors(context: Context) -> EarlierErrors:
    """Locate the errors of the stages before the rules."""
    system = context.system
    node_files = _node_files(context)
    files = {span.file.path for span in context.refused} - node_files.keys()
    affected = {node.name.value for node in system.nodes if _files(node) & files}
    elsewhere = context.is_partial
    misspelled: set[tuple[str, str]] = set()
    for span in context.refused:
        node_file = node_files.get(span.file.path)
        names = node_file.nodes_at(span) if node_file is not None else ()
        if node_file is not None and not names:
            elsewhere = True
        affected.update(names)
        section = nearest(span.text, SECTIONS) if names else None
        if section is not None:
            misspelled.update((name, section) for name in names)
    return EarlierErrors(frozenset(affected), elsewhere, frozenset(misspelled))


def is_misspelled(context: Context, key: str, near: Span) -> bool:
    """Return whether an earlier error next to ``near`` is about a misspelling of ``key``.

    The keys of a map are on one line, or on lines that follow each other.
    """
    return any(
        abs(span.line - near.line) <= _NEARBY_LINES
        and span.file == near.file
        and nearest(span.text, [key]) is not None
        for span in context.refused
    )


@dataclass(frozen=True, slots=True)
class _NodeFile:
    """A file that declares nodes: where each node starts, and where the last one ends."""

    starts: list[tuple[int, int]]
    names: dict[tuple[int, int], list[str]]  # several if one entry creates several nodes
    end: tuple[int, int] | None

    def nodes_at(self, span: Span) -> list[str]:
        """Return the nodes that contain ``span``."""
        place = (span.line, span.column)
        index = bisect_right(self.starts, place) - 1
        if index < 0 or (self.end is not None and place >= self.end):
            return []
        return self.names[self.starts[index]]


def _node_files(context: Context) -> dict[str, _NodeFile]:
    """Return the files that declare the nodes of the system, and the system file, by path."""
    system = context.system
    names: dict[str, dict[tuple[int, int], list[str]]] = {system.source.path: {}}
    for node in system.nodes:
        span = node.name.span
        in_file = names.setdefault(span.file.path, {})
        in_file.setdefault((span.line, span.column), []).append(node.name.value)
    others = [connection.span for connection in system.connections]
    others += [profile.name.span for profile in system.qos_profiles]
    others += [executor.name.span for executor in system.executors]
    others_in: dict[str, list[tuple[int, int]]] = {}
    for span in others:
        others_in.setdefault(span.file.path, []).append((span.line, span.column))
    node_files = {}
    for path, found in names.items():
        starts = sorted(found)
        following = others_in.get(path, [])
        # The first known part after the last node starts here.
        end = min((place for place in following if starts and place > starts[-1]), default=None)
        node_files[path] = _NodeFile(starts, found, end)
    return node_files


def _files(node: Node) -> set[str]:
    """Return the paths of the files that declare the ports, timers and parameters of a node."""
    names = [port.name for port in node.ports]
    names += [timer.name for timer in node.timers]
    names += [parameter.name for parameter in node.parameters]
    return {name.span.file.path for name in names}
