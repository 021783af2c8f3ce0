"""What follows from a mistake: diagnostics of certain rules about the same names."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import TypeAlias

from composer.analysis.context import Context, location
from composer.diagnostics import Diagnostic
from composer.model import ChannelKind, Connection, Node, Port, PortKind
from composer.names import join
from composer.source import Span

_QUOTED = re.compile(r"'([^']*)'")
_WORD = re.compile(r"\w+")
_SOURCES = frozenset({PortKind.PUBLISHER, PortKind.SERVICE, PortKind.ACTION_SERVER})

#: What depends on the names that connections give to ports.
_OF_CONNECTIONS = frozenset(
    {
        "broken-chain",
        "client-without-server",
        "competing-commands",
        "duplicate-server",
        "own-publisher",
        "publisher-without-subscription",
        "subscription-without-publisher",
        "unused-remapping",
    }
)
#: Errors in the ports of a connection.
_WRONG_ENDS = frozenset({"unknown-node", "unknown-port", "wrong-port-kind", "port-connected-twice"})
#: Rules, and others whose reports may follow from theirs. A warning does not hide errors: they may
#: have another cause, and the system would run with them.
_FOLLOWING = {
    "invalid-namespace": _OF_CONNECTIONS | {"unmatched-parameters"},
    "node-as-behavior": frozenset(
        {"attribute-kind", "handler-signature", "handler-without-port", "missing-handler"}
        | {"unknown-attribute", "unused-remapping"}
    ),
    "outside-qos": frozenset({"reliable-sensor-stream", "unreliable-command"}),
    "parameter-range": frozenset({"executor-busy", "executor-overloaded", "unusual-rate"}),
    "parameter-type": frozenset({"index-out-of-range", "unusual-rate"}),
    "unknown-process": frozenset({"conflicting-process", "split-executor", "unmeasured-chain"}),
}

_Ports: TypeAlias = dict[tuple[ChannelKind, str], list[tuple[Node, Port]]]


class Consequences:
    """What may follow from the mistakes of a system."""

    def __init__(self, found: Iterable[Diagnostic], context: Context) -> None:
        self._names: dict[str, set[str]] = {}  # by rules: a report that mentions one is left out
        wrong: dict[tuple[str, int], list[Diagnostic]] = {}
        for item in found:
            rules = _FOLLOWING.get(item.rule.name)
            if rules is not None:
                self._add(rules, _names(item, context))
            if item.rule.name in _WRONG_ENDS or item.rule.name == "invalid-ros-name":
                wrong.setdefault(_line(item.primary), []).append(item)
        ports: _Ports = _ports(context) if wrong else {}
        for connection in context.system.connections if wrong else ():
            if _is_wrong(connection, wrong):
                self._add(_OF_CONNECTIONS, _names_of_connection(connection, context, ports))

    def _add(self, rules: frozenset[str], names: Iterable[str]) -> None:
        known = set(names)
        for rule in rules:
            self._names.setdefault(rule, set()).update(known)

    def include(self, item: Diagnostic) -> bool:
        """Return whether a diagnostic may follow from a mistake."""
        names = self._names.get(item.rule.name)
        return names is not None and not names.isdisjoint(_mentioned(item))


def quoted(text: str | None) -> list[str]:
    """Return the names in a message."""
    return _QUOTED.findall(text or "")


def _mentioned(item: Diagnostic) -> Iterator[str]:
    """Yield the names in a message and the words at its places, and the file it is about."""
    yield from quoted(item.message)
    for span in (item.primary, *(label.span for label in item.related)):
        yield from _WORD.findall(span.text)
    yield item.primary.file.path


def _names(item: Diagnostic, context: Context) -> Iterator[str]:
    """Yield what the reports that follow from a mistake may mention."""
    yield from (*quoted(item.message), *quoted(item.hint))
    nodes = context.system.nodes
    match item.rule.name:
        case "invalid-namespace":
            namespace = quoted(item.message)[0]
            inside = [node for node in nodes if _is_inside(node.namespace.value, namespace)]
            yield from _names_around(inside, context)
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


def _is_wrong(
    connection: Connection, wrong: Mapping[tuple[str, int], Iterable[Diagnostic]]
) -> bool:
    """Return whether an error is in the name or the ports of a connection."""
    for end in (*connection.sources, *connection.sinks):
        span = end.text.span
        near = (item for item in wrong.get(_line(span), ()) if item.rule.name in _WRONG_ENDS)
        if any(_covers(span, item.primary) for item in near):
            return True
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


def _names_of_connection(connection: Connection, context: Context, ports: _Ports) -> Iterator[str]:
    """Yield the names of the channel, of the ports, and of those that may be meant instead."""
    yield join(context.system.namespace, connection.name.value)
    meant: set[str] = set()
    for end in (*connection.sources, *connection.sinks):
        node, port = context.system.node(end.node), context.system.port(end)
        is_source = end in connection.sources
        is_right = port is not None and (port.kind in _SOURCES) is is_source
        if node is not None and port is not None and is_right:
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
