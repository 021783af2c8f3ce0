"""Which callbacks publish, and the rates of publishers, topics and callbacks.

A rate is a maximum: messages that depend on a condition may be less frequent.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field

from composer.base.fast_dataclass import dataclass
from composer.base.graphs import strong_groups
from composer.model import (
    ChannelKind,
    ImplementationKind,
    Node,
    Port,
    PortKind,
    PortOfNode,
    Reaction,
    Timer,
)
from composer.python_code.lookup import BehaviorSource
from composer.python_code.nodes import (
    GENERAL_HANDLERS,
    called_methods,
    handlers,
    published_port,
    reached_methods,
)
from composer.python_code.scopes import Call
from composer.rules.analysis.context import Context, behaviors

_ENTRIES = ("on_", "accept_")


@dataclass(frozen=True, slots=True)
class Cause:
    """The callback of a timer or port that publishes."""

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
        if source is not None and id(source) not in published:
            published[id(source)] = published_by_method(source)
        by_method = {} if source is None else published[id(source)]
        for port, callbacks in causes_in_node(node, source, by_method).items():
            found[node.name.value, port] = callbacks
    return found


def causes_in_node(
    node: Node, source: BehaviorSource | None, by_method: Mapping[str, frozenset[str]]
) -> dict[str, tuple[Cause, ...]]:
    """Return the causes of the publishers of a node, as far as they are known.

    ``source`` is its behavior, and ``by_method`` the :func:`published_by_method` of it.
    """
    if source is None and node.implementation is not ImplementationKind.DECLARATIVE:
        return {}
    if source is not None and not (source.class_found and source.complete):
        return {}
    known: dict[str, list[Cause]] = {
        port.name.value: [] for port in node.ports_of(PortKind.PUBLISHER)
    }
    bound = {handler.name for handler in handlers(node)} if by_method else set()
    # Neither a handler nor a transition: it may publish at any time, for example from a thread.
    for name, ports in by_method.items():
        if name not in bound and name not in GENERAL_HANDLERS:
            for port_name in ports:
                known.pop(port_name, None)
    for cause, ports in _callbacks(node, by_method):
        for port_name in ports:
            if port_name in known:
                known[port_name].append(cause)
    return {port_name: tuple(callbacks) for port_name, callbacks in known.items()}


def _callbacks(
    node: Node, by_method: Mapping[str, frozenset[str]]
) -> Iterator[tuple[Cause, frozenset[str]]]:
    """Yield the callbacks that publish, with the names of the ports that they use."""
    for timer in node.timers:
        reactions = [timer.reaction] if timer.reaction is not None else []
        ports = _published(reactions) | by_method.get(f"on_{timer.name}", frozenset())
        if ports:
            yield Cause(timer=timer), ports
    for port in node.ports:
        events: list[Reaction] = [reaction for _, reaction in port.reactions]
        ports = _published(events) | by_method.get(f"on_{port.name}", frozenset())
        if ports:
            yield Cause(port=port), ports


def _published(reactions: list[Reaction]) -> frozenset[str]:
    return frozenset(send.port.value for reaction in reactions for send in reaction.publish)


def published_by_method(source: BehaviorSource) -> Mapping[str, frozenset[str]]:
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


def timed_publishers(context: Context) -> tuple[tuple[PortOfNode, float], ...]:
    """Return every publisher that only timers publish through, with the shortest period.

    The period is in seconds.
    """
    known_causes = context.once(causes)
    found = []
    for node in context.system.nodes:
        for port in node.ports_of(PortKind.PUBLISHER):
            of_port = known_causes.get((node.name.value, port.name.value))
            if not of_port:
                continue
            periods = [
                node.period_s(cause.timer) if cause.timer is not None else None for cause in of_port
            ]
            known = [period_s for period_s in periods if period_s is not None]
            if len(known) == len(periods):
                found.append((PortOfNode(node, port), min(known)))
    return tuple(found)


@dataclass(frozen=True, slots=True)
class Rates:
    """Rates in hertz; None if unknown."""

    causes: Causes
    topics: dict[str, float | None] = field(default_factory=dict)

    def topic_hz(self, name: str) -> float | None:
        """Return the rate of messages on a topic."""
        return self.topics.get(name)

    def publisher_hz(self, endpoint: PortOfNode) -> float | None:
        """Return the rate of messages from a publisher."""
        found = self.causes.get(endpoint.key)
        if found is None:
            return None
        return _total(self.callback_hz(endpoint.node, cause) for cause in found)

    def callback_hz(self, node: Node, cause: Cause) -> float | None:
        """Return the rate of the callback of a timer or a subscription."""
        if cause.timer is not None:
            period_s = node.period_s(cause.timer)
            return 1.0 / period_s if period_s is not None else None
        port = cause.port
        if port is None or port.kind is not PortKind.SUBSCRIPTION:
            return None
        return self.topics.get(port.full_name)


def rates(context: Context) -> Rates:
    """Return the rates of a system."""
    found = Rates(context.once(causes))
    publishers = {
        channel.name: channel.sources
        for channel in context.channels
        if channel.kind is ChannelKind.TOPIC
        and channel.sources
        and not any(
            endpoint.port.external for endpoint in channel.sinks
        )  # nodes outside the system publish there, too
    }
    for name in _in_order_of_cause(found.causes, publishers):
        found.topics[name] = _total(map(found.publisher_hz, publishers[name]))
    return found


def _in_order_of_cause(
    known: Causes, publishers: Mapping[str, tuple[PortOfNode, ...]]
) -> Iterator[str]:
    """Yield the topics, each after those whose messages cause messages on it.

    Topics in a cycle are left out: they have no rate.
    """
    causing = {
        name: {
            cause.port.full_name
            for endpoint in endpoints
            for cause in known.get(endpoint.key, ())
            if cause.port is not None and cause.port.full_name in publishers
        }
        for name, endpoints in publishers.items()
    }
    for group in strong_groups(causing):
        if len(group) == 1 and group[0] not in causing[group[0]]:
            yield group[0]


def _total(found: Iterable[float | None]) -> float | None:
    """Return the sum; None if any term is unknown."""
    total = 0.0
    for rate_hz in found:
        if rate_hz is None:
            return None
        total += rate_hz
    return total
