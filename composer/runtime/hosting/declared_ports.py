"""The ports and names that a class uses, matched with those that its node declares."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import field, replace
from typing import Any

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located
from composer.behavior import TransitionFailed
from composer.model import ChannelKind, Isolation, Node, Port, PortKind, Qos
from composer.model.names import expand_name, free_name
from composer.model.qos import PRESETS, QosProfile
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.ros.conversions import own_profile

#: Created by rclpy for every node, or by the composer.
OF_EVERY_NODE = frozenset({"/rosout", "/parameter_events", "/clock"})
#: How rcl names the channel of a remapping rule.
_SCHEMES = {ChannelKind.TOPIC: "rostopic", ChannelKind.SERVICE: "rosservice"}


class HostingError(TransitionFailed):
    """A class cannot be hosted; the text says why, and what to do instead.

    It fails the transition, without a traceback: the reason is not a mistake in the class.
    """


def interface_name(interface: Any) -> str:
    """Return the name of a message, service or action class: ``std_msgs/msg/String``."""
    package, _, rest = interface.__module__.partition(".")
    return f"{package}/{rest.partition('.')[0]}/{interface.__name__}"


@dataclass(slots=True)
class DeclaredPorts:
    """The declared ports of a node, and which of them its class has created.

    ``on_undeclared`` is called with the first port on each name that the class creates without a
    declaration. ``differences`` are the ports whose QoS is not the declared one. ``awaited`` are
    the topics of which the class has waited for one message.
    """

    node: Node
    on_undeclared: Callable[[Port], None]
    created: set[str] = field(default_factory=set)  # names in use
    differences: list[str] = field(default_factory=list)
    awaited: set[str] = field(default_factory=set)
    _reported: set[tuple[PortKind, str]] = field(default_factory=set)

    def port(self, kind: PortKind, full_name: str, interface: Any, qos: Any = None) -> Port:
        """Return the port of an endpoint that the class creates, with its actual QoS.

        Raises HostingError if another type is declared for it.
        """
        profile = PRESETS["services_default"] if qos is None else own_profile(qos)
        created = interface_name(interface)
        for port in self.node.ports_of(kind):
            if port.full_name == full_name and port.name.value not in self.created:
                return self._declared(port, created, profile)
        port = self._undeclared(kind, full_name, created, profile)
        self.created.add(port.name.value)
        if full_name not in OF_EVERY_NODE and (kind, full_name) not in self._reported:
            self._reported.add((kind, full_name))
            self.on_undeclared(port)
        return port

    def missing(self) -> Iterator[Port]:
        """Yield the declared ports that the class has not created."""
        for port in self.node.ports:
            if port.name.value not in self.created and port.full_name not in self.awaited:
                yield port

    def forget(self, port: Port) -> None:
        """Know that the class has destroyed an endpoint, and may create it again."""
        self.created.discard(port.name.value)

    def _declared(self, port: Port, created: str, profile: QosProfile) -> Port:
        declared = port.interface.value
        if declared != created:
            raise HostingError(
                f"{port.kind} '{port.name}' on {port.full_name} is declared as {declared},"
                f" but the class creates {created}; declare 'type: {created}'"
            )
        self.created.add(port.name.value)
        if port.kind in (PortKind.PUBLISHER, PortKind.SUBSCRIPTION):
            difference = _difference(port.qos.profile, profile)
            if difference:
                self.differences.append(f"{port.kind} '{port.name}': {difference}")
        return replace(port, qos=replace(port.qos, profile=profile))

    def _undeclared(
        self, kind: PortKind, full_name: str, interface: str, profile: QosProfile
    ) -> Port:
        span = self.node.span
        used = self.created | {port.name.value for port in self.node.ports}
        name = free_name(full_name.strip("/"), used)  # counters are kept by name
        return Port(
            kind=kind,
            name=Located(name, span),
            interface=Located(interface, span),
            ros_name=Located(full_name, span),
            full_name=full_name,
            qos=Qos(profile, span, explicit=False),
            span=span,
            isolation=Isolation.COPY,
        )


def report_undeclared(context: NodeContext, port: Port) -> None:
    """Log that a port is not declared, unless its messages are delivered in the process."""
    if not context.router.delivers(port):
        text = f"{port.kind} on {port.full_name} is not declared: it uses DDS ({port.interface})"
        context.log.info(text)


def _difference(declared: QosProfile, actual: QosProfile) -> str:
    """Return how the QoS that matters for matching differs; empty if it does not."""
    names = ("reliability", "durability", "deadline_ms", "liveliness")
    different = [name for name in names if getattr(declared, name) != getattr(actual, name)]
    return ", ".join(
        f"{name} is {getattr(actual, name)}, declared as {getattr(declared, name)}"
        for name in different
    )


def remapping_arguments(node: Node) -> list[str]:
    """Return the command-line arguments that give rcl the names of the node's topics and services.

    As with ``ros2 run --ros-args -r``, the first matching rule counts: connections come before
    remappings.
    """
    written = (f"{item.source}:={item.target}" for item in node.remappings)
    rules = [*_connected(node), *written]
    words = [word for rule in dict.fromkeys(rules) for word in ("-r", rule)]
    return ["--ros-args", *words] if words else []


def action_names(node: Node) -> Mapping[tuple[PortKind, str], str]:
    """Return the full names of actions by their kind and the expanded name: rcl remaps none."""
    found: dict[tuple[PortKind, str], str] = {}
    for port in node.ports_of(PortKind.ACTION_SERVER, PortKind.ACTION_CLIENT):
        found.setdefault((port.kind, _expanded(node, port.ros_name.value)), port.full_name)
    for remapping in node.remappings:
        for kind in (PortKind.ACTION_SERVER, PortKind.ACTION_CLIENT):
            source = _expanded(node, remapping.source.value)
            found.setdefault((kind, source), _expanded(node, remapping.target.value))
    return found


def _connected(node: Node) -> Iterator[str]:
    for port in node.ports:
        scheme = _SCHEMES.get(port.kind.channel)
        own = _expanded(node, port.ros_name.value)
        if scheme is not None and own != port.full_name:
            yield f"{scheme}://{own}:={port.full_name}"


def _expanded(node: Node, name: str) -> str:
    return expand_name(name, node.ros_name.value, node.namespace.value)
