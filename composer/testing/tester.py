"""The node of a test in a system: the other end of each topic and server."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from composer.base.source import Located
from composer.behavior import Behavior
from composer.model import (
    BehaviorReference,
    ChannelKind,
    Dependency,
    Introspection,
    Node,
    OnFailure,
    Port,
    PortKind,
    Qos,
    Supervision,
    System,
    channels,
)
from composer.model.qos import History, QosProfile, strictest_compatible, strongest
from composer.testing.failures import unknown

#: The key and the name of the node.
TESTER: Final = "compose_test"
_NO_SERVICES = Introspection(
    parameters=False, rosout=False, type_description=False, lifecycle_services=False
)
#: What a node of the system has at the other end of a port of the test, in failures.
_OTHER_ENDS = {
    PortKind.SUBSCRIPTION: "publisher on",
    PortKind.PUBLISHER: "subscription to",
    PortKind.CLIENT: "service",
    PortKind.ACTION_CLIENT: "action server",
}


class Tester(Behavior):
    """Passes the messages of all topics to the test: ``on_message(topic, message)``.

    A port is named by its kind and the full name of its topic, service or action.
    """

    on_message: Callable[[str, Any], None]

    def __getattr__(self, name: str) -> Callable[[Any], None]:
        """Return the handler ``on_<port>`` of a subscription."""
        prefix, _, topic = name.partition(f"on_{PortKind.SUBSCRIPTION}:")
        if prefix or not topic:
            raise AttributeError(name)
        return lambda message: self.on_message(topic, message)


def port_to(tester: Node, kind: PortKind, full_name: str) -> str:
    """Return the name of the test's port to a topic, service or action. Raises TestFailure."""
    name = _port_name(kind, full_name)
    if tester.port(name) is None:
        names = [port.full_name for port in tester.ports if port.kind is kind]
        text = f"no node of the system has a {_OTHER_ENDS[kind]} '{full_name}'"
        raise unknown(text, full_name, names)
    return name


def _port_name(kind: PortKind, full_name: str) -> str:
    return f"{kind}:{full_name}"


def with_tester(system: System) -> System:
    """Return the system with a node for the test, which all others wait for."""
    tester = _tester(system)
    waits = Dependency(tester.name)
    nodes = (replace(node, depends_on=(*node.depends_on, waits)) for node in system.nodes)
    return replace(system, nodes=(tester, *nodes))


def _tester(system: System) -> Node:
    span = system.name.span
    namespace = Located("/", span)
    return Node(
        Located(TESTER, span),
        namespace,
        span,
        behavior=BehaviorReference(
            Located(f"{Tester.__module__}:{Tester.__name__}", span), Path(__file__).parent
        ),
        ports=tuple(_ports(system)),
        supervision=Supervision(on_failure=Located(OnFailure.SHUTDOWN, span)),
        introspection=_NO_SERVICES,
    )


def _ports(system: System) -> Iterator[Port]:
    nodes = [node for node in system.nodes if node.in_process]
    for channel in channels(nodes, with_transforms=True):
        types = {end.port.interface.value for end in channel.ends}
        if len(types) > 1:
            continue  # it needs the middleware; validation has reported it
        sources = [end.port for end in channel.sources]
        sinks = [end.port for end in channel.sinks]
        if channel.kind is ChannelKind.TOPIC:
            if sources:
                yield _port(PortKind.SUBSCRIPTION, sources, _recording(sources))
            if sinks:
                yield _port(PortKind.PUBLISHER, sinks, _offering(sinks))
        elif len(sources) == 1:
            is_service = channel.kind is ChannelKind.SERVICE
            kind = PortKind.CLIENT if is_service else PortKind.ACTION_CLIENT
            yield _port(kind, sources, sources[0].qos.profile)


def _recording(publishers: Sequence[Port]) -> QosProfile:
    """Return the profile of a subscription that keeps all messages of these publishers."""
    offers = [port.qos.profile for port in publishers]
    return replace(strictest_compatible(offers, offers[0].depth), history=History.KEEP_ALL)


def _offering(subscriptions: Sequence[Port]) -> QosProfile:
    """Return the profile of a publisher to these subscriptions."""
    requests = [port.qos.profile for port in subscriptions]
    reliability, durability = strongest(requests)
    return replace(requests[0], reliability=reliability, durability=durability)


def _port(kind: PortKind, others: Sequence[Port], profile: QosProfile) -> Port:
    """Return the port of the test at the other end of ``others``."""
    first = others[0]
    name = Located(_port_name(kind, first.full_name), first.span)
    return Port(
        kind,
        name,
        first.interface,
        Located(first.full_name, first.span),
        first.full_name,
        Qos(profile, first.qos.span),
        first.span,
    )
