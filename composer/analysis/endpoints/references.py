"""How a system refers to ports, ROS names and QoS profiles."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.model import Endpoint, Node, Port, Remapping, System
from composer.names import expand_name, remapped_name
from composer.qos import PRESETS
from composer.source import Located


def endpoints(system: System) -> Iterator[Endpoint]:
    """Yield the ports that connections and chains refer to."""
    for connection in system.connections:
        yield from connection.sources
        yield from connection.sinks
    for chain in system.chains:
        yield from chain.through


def own_name(node: Node, name: str) -> str:
    """Return the full name of ``name`` in ``node`` before remapping."""
    return expand_name(name, node.ros_name.value, node.namespace.value)


def matched_ports(node: Node, remapping: Remapping) -> Iterator[Port]:
    """Yield the ports whose declared name the remapping replaces."""
    source = own_name(node, remapped_name(remapping.source.value))
    for port in node.all_ports:
        if own_name(node, port.ros_name.value) == source:
            yield port


def unknown_profiles(context: Context) -> tuple[Located[str], ...]:
    """Return the references to profiles that do not exist."""
    known = known_profiles(context)
    if context.is_partial:
        return ()
    return tuple(
        reference.name
        for reference in context.system.qos_references
        if reference.name.value not in known and not is_unresolved(reference.name.value)
    )


def known_profiles(context: Context) -> frozenset[str]:
    """Return the names of the system's own profiles and of the presets."""
    own = (profile.name.value for profile in context.system.qos_profiles)
    return frozenset((*own, *PRESETS))


def class_name_hint(text: str) -> str:
    """Return the hint for ``text`` in place of ``module:Class``."""
    module, _, name = text.rstrip(":").rpartition(".")
    is_dotted = bool(module) and name[:1].isupper()
    return f"did you mean '{module}:{name}'?" if is_dotted else "write 'module:Class'"
