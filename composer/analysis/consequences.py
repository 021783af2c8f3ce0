"""What follows from a mistake: diagnostics of certain rules about the same names."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import TypeAlias

from composer.analysis.context import Context, location
from composer.diagnostics import Diagnostic
from composer.model import ChannelKind, Connection, Endpoint, Node, Port, PortKind
from composer.names import join
from composer.source import Span

_QUOTED = re.compile(r"'([^']*)'")
_WORD = re.compile(r"\w+")
#: The name of an interface, without its part such as '_Request'.
_INTERFACE = re.compile(r"[a-z]\w*/(?:msg|srv|action)/[A-Za-z0-9]+")
_NAMESPACE = re.compile(r"\bnamespace\b")
_NEARBY = 200  # characters before a variable, in which the key of its value is
#: What is only reported because nodes are not in their namespaces.
_OF_NAMESPACES = frozenset({"duplicate-server", "port-connected-twice"})
_SOURCES = frozenset({PortKind.PUBLISHER, PortKind.SERVICE, PortKind.ACTION_SERVER})

#: What depends on the names that connections give to ports.
_OF_CONNECTIONS = frozenset(
    {
        "impossible-chain",
        "client-without-server",
        "competing-commands",
        "duplicate-server",
        "own-publisher",
        "publisher-without-subscription",
        "subscription-without-publisher",
        "unused-remapping",
    }
)
#: What depends on the names of nodes.
_OF_NAMES = _OF_CONNECTIONS | {"missing-parameter", "unmatched-parameters"}
#: Errors in the ports of a connection.
_WRONG_ENDS = frozenset(
    {"unknown-node", "unknown-port", "wrong-port-kind", "port-connected-twice", "type-mismatch"}
)
#: What may only be reported because a folder of the project is missing.
_OF_NODE_FOLDERS = frozenset({"unknown-node-type"})
_OF_FOLDERS = frozenset({"unknown-interface", "module-not-installed", "unknown-import"})
#: Rules, and others whose reports may follow from theirs. A warning does not hide errors: they may
#: have another cause, and the system would run with them.
_FOLLOWING = {
    "class-port-missing": frozenset({"unknown-port"}),
    "class-port-type": frozenset({"type-mismatch"}),
    "duplicate-name": frozenset({"unknown-parameter"}),
    "key-without-value": frozenset({"unknown-name", "unknown-word"}),
    "invalid-include": frozenset({"invalid-name", "unknown-node", "unknown-port"}),
    "invalid-namespace": _OF_CONNECTIONS | {"unmatched-parameters"},
    "node-as-behavior": frozenset(
        {"call-arguments", "handler-signature", "handler-without-port", "missing-attribute"}
        | {"missing-handler", "missing-return", "too-early", "type-error", "unknown-attribute"}
        | {"unused-remapping"}
    ),
    "outside-qos": frozenset({"reliable-sensor-stream", "unreliable-delivery"}),
    "parameter-file": frozenset({"missing-parameter"}),
    "parameter-value": frozenset(
        {"executor-overloaded", "index-out-of-range", "invalid-value", "timer-period"}
        | {"unusual-rate"}
    ),
    "type-mismatch": frozenset(
        {"handler-annotation", "invalid-value", "port-connected-twice", "unknown-field"}
        | {"wrong-message-type"}
    ),
    "undeclared-parameter": frozenset({"class-parameter"}),
    "unknown-key": frozenset({"transform-source", "restart-settings"}),
    "unknown-port": frozenset({"handler-without-port"}),
    "yaml-syntax": frozenset({"missing-parameter"}),
}
#: What depends on the nodes of a process.
_OF_PROCESSES = frozenset({"conflicting-process", "split-executor", "unmeasured-chain"})
#: Mistakes that may be the reason for all reports of the other rules: the name of what an
#: unreadable file would set is not known.
_WITHOUT_NAMES = frozenset({"parameter-file", "yaml-syntax"})

_Errors: TypeAlias = Mapping[tuple[str, int], list[Diagnostic]]
_Ports: TypeAlias = dict[tuple[ChannelKind, str], list[tuple[Node, Port]]]


class Consequences:
    """What may follow from the mistakes of a system."""

    def __init__(self, found: Iterable[Diagnostic], context: Context) -> None:
        self._names: dict[str, set[str]] = {}  # by rules: a report that mentions one is left out
        self._all: set[str] = set()  # rules whose reports are all left out
        wrong: dict[tuple[str, int], list[Diagnostic]] = {}
        for item in found:
            rules = _FOLLOWING.get(item.rule.name)
            everything = _left_out_of_all(item)
            if everything:
                self._all |= everything
            elif item.rule.name == "unknown-variable":
                self._add(_OF_NAMES, _names_with(quoted(item.message)[0], context))
            elif rules is not None:
                self._add(rules, _names(item, context))
            if any(kind == "process" for kind, _ in item.subjects):
                self._add(_OF_PROCESSES, (*quoted(item.message), *quoted(item.hint)))
            if item.rule.name in _WRONG_ENDS or item.rule.name == "invalid-name":
                wrong.setdefault(_line(item.primary), []).append(item)
        ports: _Ports = _ports(context) if wrong else {}
        for connection in context.system.connections if wrong else ():
            ends = _wrong_ends(connection, wrong)
            if ends or _has_wrong_name(connection, wrong):
                names = _names_of_connection(connection, ends, context, ports)
                self._add(_OF_CONNECTIONS, names)

    def _add(self, rules: frozenset[str], names: Iterable[str]) -> None:
        known = set(names)
        for rule in rules:
            self._names.setdefault(rule, set()).update(known)

    def include(self, item: Diagnostic) -> bool:
        """Return whether a diagnostic may follow from a mistake."""
        if item.rule.name in self._all:
            return True
        names = self._names.get(item.rule.name)
        return names is not None and not names.isdisjoint(_mentioned(item))


def _left_out_of_all(item: Diagnostic) -> frozenset[str]:
    """Return the rules whose reports may all follow from a mistake, whatever they mention."""
    if "is not a folder" in item.message:
        return _of_folder(item.primary)
    if item.rule.name in _WITHOUT_NAMES:
        return _FOLLOWING[item.rule.name]
    return _OF_NAMESPACES if _lacks_namespace(item) else frozenset()


def _is_of_namespace(span: Span) -> bool:
    line = span.file.line(span.line)
    return _NAMESPACE.search(line[max(0, span.column - _NEARBY) : span.column]) is not None


def _of_folder(span: Span) -> frozenset[str]:
    """Return what may follow from a folder that is missing: of interfaces, of node types or any."""
    line = span.file.line(span.line)
    if "interfaces" in line:
        return _OF_FOLDERS
    return _OF_NODE_FOLDERS if "nodes" in line else _OF_FOLDERS | _OF_NODE_FOLDERS


def _lacks_namespace(item: Diagnostic) -> bool:
    """Return whether nodes lack their namespace: its variable, or the key of an include, is wrong.

    The prefix of an include separates its nodes as well.
    """
    if item.rule.name == "unknown-variable":
        return _is_of_namespace(item.primary)
    meant = {"namespace", "prefix"}.intersection(quoted(item.hint))
    is_key = item.rule.name == "unknown-key" and item.message.endswith("this include")
    return is_key and bool(meant)


def quoted(text: str | None) -> list[str]:
    """Return the names in a message."""
    return _QUOTED.findall(text or "")


def _mentioned(item: Diagnostic) -> Iterator[str]:
    """Yield the names in a message and the words at its places, and the file it is about."""
    yield from quoted(item.message)
    yield from _INTERFACE.findall(item.message)
    for span in (item.primary, *(label.span for label in item.related)):
        yield from _WORD.findall(span.text)
    yield item.primary.file.path


def _names(item: Diagnostic, context: Context) -> Iterator[str]:
    """Yield what the reports that follow from a mistake may mention."""
    if item.rule.name == "type-mismatch":
        yield from quoted(item.message)[:-1]  # without the right type
        return
    if item.rule.name == "unknown-port":
        yield from (f"on_{name}" for name in quoted(item.message)[-1:])
        return
    names = (*quoted(item.message), *quoted(item.hint))
    yield from (name.strip("{}") if name.startswith("{") else name for name in names)
    nodes = context.system.nodes
    match item.rule.name:
        case "invalid-namespace":
            namespace = quoted(item.message)[0]
            inside = [node for node in nodes if _is_inside(node.namespace.value, namespace)]
            yield from _names_around(inside, context)
        case "class-port-type":
            ports_at = (port for node in nodes for port in node.ports)
            yield from (port.full_name for port in ports_at if port.interface.span == item.primary)
        case "unknown-key" if "lifecycle" in item.message:
            yield item.primary.file.path
        case "node-as-behavior":
            yield from (label.span.file.path for label in item.related)
            for node in nodes:
                if node.behavior is not None and node.behavior.text.span == item.primary:
                    yield from (remapping.source.value for remapping in node.remappings)
                    yield from (f"{node.name}.{port.name}" for port in node.ports)
        case "outside-qos":
            ports = {f"{node.name}.{port.name}": port for node in nodes for port in node.ports}
            known = (ports.get(name) for name in quoted(item.message))
            yield from (port.full_name for port in known if port is not None)


def _names_with(variable: str, context: Context) -> Iterator[str]:
    """Yield the nodes whose names a variable is missing in, and the names of their ports."""
    written = f"${{{variable}}}"
    unnamed = [node for node in context.system.nodes if written in node.name.value]
    yield from (node.name.value for node in unnamed)
    yield from _names_around(unnamed, context) if unnamed else ()


def _is_inside(namespace: str, outer: str) -> bool:
    return f"{namespace}/".startswith(f"{outer.rstrip('/')}/")


def _names_around(nodes: list[Node], context: Context) -> Iterator[str]:
    """Yield the names of nodes and ports that differ only in their namespaces from those given."""
    ports = [(node, port) for node in nodes for port in node.ports]
    yield from (f"{node.name}.{port.name}" for node, port in ports)
    last_parts = {port.full_name.rpartition("/")[2] for _, port in ports}
    for channel in context.channels:
        if channel.name.rpartition("/")[2] in last_parts:
            yield channel.name
    own_names = {node.ros_name.value for node in nodes}
    for unmatched in context.system.unmatched_parameters:
        if unmatched.section.value.rpartition("/")[2] in own_names:
            yield unmatched.section.value


def _line(span: Span) -> tuple[str, int]:
    return span.file.path, span.line


def _wrong_ends(connection: Connection, wrong: _Errors) -> list[Endpoint]:
    """Return the ports of a connection that an error points at."""
    return [
        end
        for end in connection.ends
        if any(
            item.rule.name in _WRONG_ENDS and _covers(end.text.span, item.primary)
            for item in wrong.get(_line(end.text.span), ())
        )
    ]


def _has_wrong_name(connection: Connection, wrong: _Errors) -> bool:
    name = connection.name.span
    near = (item for item in wrong.get(_line(name), ()) if item.rule.name not in _WRONG_ENDS)
    return any(location(item.primary) == location(name) for item in near)


def _covers(whole: Span, part: Span) -> bool:
    is_same_line = (whole.file.path, whole.line) == (part.file.path, part.line)
    return is_same_line and 0 <= part.column - whole.column < whole.length


def _ports(context: Context) -> _Ports:
    """Return all ports by their kinds and names, and by the names of their nodes with a dot."""
    found: _Ports = {}
    for node in context.system.nodes:
        for port in node.ports:
            for name in (port.name.value, f"{node.name}."):
                found.setdefault((port.kind.channel, name), []).append((node, port))
    return found


def _names_of_connection(
    connection: Connection, wrong: list[Endpoint], context: Context, ports: _Ports
) -> Iterator[str]:
    """Yield the names of the channel, of the ports, and of those that may be meant instead."""
    yield join(context.system.namespace, connection.name.value)
    meant: set[str] = set()
    for end in connection.ends:
        node, port = context.system.node(end.node), context.system.port(end)
        is_source = end in connection.sources
        is_right = port is not None and (port.kind in _SOURCES) is is_source
        if node is not None and port is not None and is_right and end not in wrong:
            yield from _names_of_port(node, port)
        else:
            meant.update((end.port, f"{end.node}."))
    for name in meant:
        for node, port in ports.pop((connection.kind, name), ()):  # once for all connections
            yield from _names_of_port(node, port)


def _names_of_port(node: Node, port: Port) -> Iterator[str]:
    yield f"{node.name}.{port.name}"
    yield port.full_name
    yield join(node.namespace.value, port.ros_name.value)  # without the connection
