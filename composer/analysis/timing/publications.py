"""Which callbacks of a node publish, according to its YAML and its behavior."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from composer.analysis.context import Context
from composer.analysis.python_nodes import behaviors
from composer.fast_dataclass import dataclass
from composer.model import ImplementationKind, Node, Port, PortKind, Reaction, Timer
from composer.python_code.nodes.behaviors import (
    GENERAL_HANDLERS,
    called_methods,
    handlers,
    reached_methods,
)
from composer.python_code.source import BehaviorSource, Call, published_port

_ENTRIES = ("on_", "accept_")


@dataclass(frozen=True, slots=True)
class Cause:
    """A callback that publishes: that of a timer or of a port."""

    timer: Timer | None = None
    port: Port | None = None


#: For each node and publisher, the callbacks that publish through it; unknown ones are left out.
Causes = Mapping[tuple[str, str], tuple[Cause, ...]]


def causes(context: Context) -> Causes:
    """Return the causes of every publisher for which they are known.

    Messages that are published once, in a lifecycle transition, are ignored.
    """
    sources = {node.name.value: source for node, source in behaviors(context)}
    published: dict[int, Mapping[str, frozenset[str]]] = {}
    found: dict[tuple[str, str], tuple[Cause, ...]] = {}
    for node in context.system.nodes:
        source = sources.get(node.name.value)
        if source is None and node.implementation is not ImplementationKind.DECLARATIVE:
            continue
        if source is not None and not (source.class_found and source.complete):
            continue
        by_method: Mapping[str, frozenset[str]] = {}
        if source is not None:
            if id(source) not in published:
                published[id(source)] = _published_by_method(source)
            by_method = published[id(source)]
        found.update(_of_node(node, by_method))
    return found


def _of_node(
    node: Node, by_method: Mapping[str, frozenset[str]]
) -> Iterator[tuple[tuple[str, str], tuple[Cause, ...]]]:
    known: dict[str, list[Cause]] = {
        port.name.value: [] for port in node.ports_of(PortKind.PUBLISHER)
    }
    bound = {handler.name for handler in handlers(node)}
    # Neither a handler nor a transition: it may publish at any time, for example from a thread.
    for name, ports in by_method.items():
        if name not in bound and name not in GENERAL_HANDLERS:
            for port_name in ports:
                known.pop(port_name, None)
    for cause, ports in _callbacks(node, by_method):
        for port_name in ports:
            if port_name in known:
                known[port_name].append(cause)
    for port_name, found in known.items():
        yield (node.name.value, port_name), tuple(found)


def _callbacks(
    node: Node, by_method: Mapping[str, frozenset[str]]
) -> Iterator[tuple[Cause, frozenset[str]]]:
    """Yield every callback with the names of the ports that it publishes through."""
    for timer in node.timers:
        reactions = [timer.reaction] if timer.reaction is not None else []
        ports = _published(reactions) | by_method.get(f"on_{timer.name}", frozenset())
        yield Cause(timer=timer), ports
    for port in node.ports:
        events: list[Reaction] = [reaction for _, reaction in port.reactions]
        ports = _published(events) | by_method.get(f"on_{port.name}", frozenset())
        yield Cause(port=port), ports


def _published(reactions: list[Reaction]) -> frozenset[str]:
    return frozenset(send.port.value for reaction in reactions for send in reaction.publish)


def _published_by_method(source: BehaviorSource) -> Mapping[str, frozenset[str]]:
    """Return the publishers that the methods of a behavior use.

    Methods called by handlers are not listed separately. Publishers used by nested functions,
    passed on or stored are listed under the name "", because they may publish at any time.
    """
    entries = [method for method in source.methods if method.name.startswith(_ENTRIES)]
    called_by_handlers = {
        call.name.removeprefix("self.")
        for method in reached_methods(source, *entries)
        for call in method.calls
        if not call.deferred
    }
    direct = {
        name: ports
        for name, ports in _reached_ports(source).items()
        if name.startswith(_ENTRIES) or name not in called_by_handlers
    }
    calls = (call for method in source.methods for call in method.calls)
    deferred = _ports_in(call for call in calls if call.deferred)
    whenever = deferred | _passed_on(source)
    return {name: ports for name, ports in {**direct, "": whenever}.items() if ports}


def _reached_ports(source: BehaviorSource) -> Mapping[str, frozenset[str]]:
    """Return the publishers that each method uses itself, or through the methods that it calls."""
    ports = {}
    callers: dict[str, list[str]] = {}
    for method in source.methods:
        ports[method.name] = _ports_in(call for call in method.calls if not call.deferred)
        for callee in called_methods(source, method):
            callers.setdefault(callee.name, []).append(method.name)
    pending = [name for name, found in ports.items() if found]
    while pending:
        name = pending.pop()
        for caller in callers.get(name, ()):
            if not ports[name] <= ports[caller]:
                ports[caller] |= ports[name]
                pending.append(caller)
    return ports


def _passed_on(source: BehaviorSource) -> frozenset[str]:
    """Return the publishers that a behavior passes on or stores; their uses are unknown."""
    names = (name for method in source.methods for name in method.mentioned)
    stored = (name.removesuffix(".publish") for name in names)
    parts = (name.removeprefix("self.publishers.") for name in stored if name.count(".") == 2)
    return frozenset(name for name in parts if "." not in name)


def _ports_in(calls: Iterable[Call]) -> frozenset[str]:
    """Return the ports of calls like ``self.publishers.status.publish``."""
    found = (published_port(call.name) for call in calls)
    return frozenset(port for port in found if port is not None)
