"""What makes a node publish: which timers and subscriptions, in YAML and in its behaviour."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from composer.analysis.behaviors import GENERAL_HANDLERS, behaviors, handlers
from composer.analysis.context import Context
from composer.analysis.python_calls import calls_of, handed_on
from composer.behavior_source import BehaviorSource, Call, published_port
from composer.model import Node, Port, PortKind, Reaction, Timer

_ENTRIES = ("on_", "accept_")


@dataclass(frozen=True, slots=True)
class Cause:
    """The callback that publishes: of a timer, or of a port."""

    timer: Timer | None = None
    port: Port | None = None


#: For each node and publisher the callbacks that publish through it; what nobody knows is missing.
Causes = Mapping[tuple[str, str], tuple[Cause, ...]]


def causes(context: Context) -> Causes:
    """Return what makes every publisher publish, where that is known.

    What is published once, at a transition of the node's lifecycle, is left out of account.
    """
    sources = {node.name.value: source for node, source in context.once(behaviors)}
    published: dict[int, Mapping[str, frozenset[str]]] = {}
    found: dict[tuple[str, str], tuple[Cause, ...]] = {}
    for node in context.system.nodes:
        source = sources.get(node.name.value)
        if source is None and node.behavior is not None:
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
    # Neither a handler nor a transition: a thread, perhaps, which publishes when it likes.
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
    """Yield every callback with the ports that it publishes through."""
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
    """Return the publishers that the methods of a behaviour use.

    A method that handlers lead to is not listed on its own. What a function within a method
    publishes, or who got hold of a publisher, is listed under no name: it may run at any time.
    """
    calls = {method.name: tuple(calls_of(source, method)) for method in source.methods}
    handled = {
        call.name.removeprefix("self.")
        for name, found in calls.items()
        if name.startswith(_ENTRIES)
        for call in found
        if not call.deferred
    }
    direct = {
        name: _ports_in(call for call in found if not call.deferred)
        for name, found in calls.items()
        if name.startswith(_ENTRIES) or name not in handled
    }
    deferred = _ports_in(call for found in calls.values() for call in found if call.deferred)
    whenever = deferred | handed_on(source)
    return {name: ports for name, ports in {**direct, "": whenever}.items() if ports}


def _ports_in(calls: Iterable[Call]) -> frozenset[str]:
    """Return the ports of calls such as ``self.publishers.status.publish``."""
    found = (published_port(call.name) for call in calls)
    return frozenset(port for port in found if port is not None)
