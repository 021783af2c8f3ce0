"""What SROS2 checks: what each process may publish, subscribe to, call and serve.

https://design.ros2.org/articles/ros2_access_control_policies.html defines the format. Each process
has an enclave, because DDS checks participants; the profiles in it are those of its nodes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import field
from xml.etree import ElementTree as Xml

from composer.base.fast_dataclass import dataclass
from composer.model import USE_SIM_TIME, ImplementationKind, Node, PortKind, System, member_system
from composer.model.names import join
from composer.model.node import LIFECYCLE_SERVICES, LOGGER_SERVICES, PARAMETER_SERVICES

_VERSION = "0.2.0"
_MANAGER = "manager"
#: The self-test of the middleware at each start, on a topic of its own.
SELF_TEST_TOPICS = "/_compose_trial/*"
_COMMANDS = (
    *("is_active", "pause", "request", "reset", "resume", "shutdown", "startup"),
    *("resume_all_or_nothing", "startup_all_or_nothing"),
)
#: Section, its attribute, and the element of one name, by the kind of a port.
_RULES = {
    PortKind.PUBLISHER: ("topics", "publish", "topic"),
    PortKind.SUBSCRIPTION: ("topics", "subscribe", "topic"),
    PortKind.SERVICE: ("services", "reply", "service"),
    PortKind.CLIENT: ("services", "request", "service"),
    PortKind.ACTION_SERVER: ("actions", "execute", "action"),
    PortKind.ACTION_CLIENT: ("actions", "call", "action"),
}


@dataclass(frozen=True, slots=True)
class Profile:
    """What one node may do: full names by the kind of endpoint."""

    node: str
    namespace: str
    names: dict[PortKind, set[str]] = field(default_factory=dict)

    @property
    def full_name(self) -> str:
        """The full name of the node."""
        return join(self.namespace, self.node)

    def allow(self, kind: PortKind, *names: str) -> None:
        """Allow endpoints; names are below the node unless they are absolute."""
        for name in names:
            self.names.setdefault(kind, set()).add(join(self.full_name, name))


@dataclass(frozen=True, slots=True)
class Enclave:
    """A process: the path of its enclave, and the profiles of its nodes."""

    path: str
    profiles: tuple[Profile, ...]


def enclaves(system: System) -> tuple[Enclave, ...]:
    """Return the enclaves of a system: one for each of its processes, its own first.

    Executables are in the enclave of the process that starts them; external nodes are in none.
    """
    namespace = join(system.namespace, system.name.value)
    parts = [member_system(system, process.name.value) for process in system.processes]
    manager = _manager(namespace, system)
    for part in parts:
        member = join(part.namespace, f"{part.name.value}/{_MANAGER}")
        manager.allow(PortKind.CLIENT, f"{member}/request")
        manager.allow(PortKind.SUBSCRIPTION, f"{member}/state")
    own = [node for node in system.nodes if node.process is None]
    found = [Enclave(namespace, (manager, *_profiles(own)))]
    for part in parts:
        path = join(part.namespace, part.name.value)
        found.append(Enclave(path, (_manager(path, part), *_profiles(part.nodes))))
    return tuple(found)


def policy(system: System) -> str:
    """Return the policy file of a system."""
    root = Xml.Element("policy", version=_VERSION)
    listed = Xml.SubElement(root, "enclaves")
    for enclave in enclaves(system):
        element = Xml.SubElement(listed, "enclave", path=enclave.path)
        profiles = Xml.SubElement(element, "profiles")
        for profile in enclave.profiles:
            _write(profile, profiles)
    return _document(root, system.name.value)


def _document(root: Xml.Element, system: str) -> str:
    Xml.indent(root)
    comment = f"<!-- Written by 'compose export sros2' for the system {system}. -->"
    text = Xml.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{comment}\n{text}\n'


def _write(profile: Profile, parent: Xml.Element) -> None:
    namespace = profile.namespace
    element = Xml.SubElement(parent, "profile", ns=namespace, node=profile.node)
    for kind, (section, attribute, item) in _RULES.items():
        names = sorted(profile.names.get(kind, ()))
        if names:
            rules = Xml.SubElement(element, section, {attribute: "ALLOW"})
            for name in names:
                Xml.SubElement(rules, item).text = name


def _manager(namespace: str, system: System) -> Profile:
    """Return the profile of a manager node."""
    profile = Profile(_MANAGER, namespace)
    profile.allow(PortKind.PUBLISHER, "/diagnostics", "state", "callbacks")
    profile.allow(PortKind.PUBLISHER, "/parameter_events", "/rosout", SELF_TEST_TOPICS)
    profile.allow(PortKind.SUBSCRIPTION, "/clock", SELF_TEST_TOPICS)
    profile.allow(PortKind.SERVICE, *_COMMANDS, *PARAMETER_SERVICES, *LOGGER_SERVICES)
    profile.allow(PortKind.SERVICE, "get_type_description")
    profile.allow(PortKind.SERVICE, "_instance_*")
    profile.allow(PortKind.CLIENT, "_instance_*")
    for node in system.nodes:
        for port in node.transforms.ports if node.transforms is not None else ():
            if port.kind is PortKind.SUBSCRIPTION:  # one for all nodes
                profile.allow(port.kind, port.full_name)
        if _is_driven(node):
            name = node.full_name
            profile.allow(PortKind.CLIENT, f"{name}/change_state", f"{name}/get_state")
            profile.allow(PortKind.SUBSCRIPTION, f"{name}/transition_event")
        if node.name.value in _containers(system.nodes):
            profile.allow(PortKind.CLIENT, *_container_services(node))
    return profile


def _containers(nodes: Iterable[Node]) -> set[str]:
    """Return the keys of the nodes that load components."""
    return {node.container.value for node in nodes if node.container is not None}


def _container_services(node: Node) -> Iterator[str]:
    for name in ("load_node", "unload_node", "list_nodes"):
        yield f"{node.full_name}/_container/{name}"


def _is_driven(node: Node) -> bool:
    """Return whether the manager drives a node by its lifecycle services."""
    return node.outside is not None and node.outside.is_managed


def _profiles(nodes: Sequence[Node]) -> Iterator[Profile]:
    containers = _containers(nodes)
    for node in nodes:
        if node.implementation is not ImplementationKind.EXTERNAL:
            profile = _profile(node)
            if node.name.value in containers:
                profile.allow(PortKind.SERVICE, *_container_services(node))
            yield profile


def _profile(node: Node) -> Profile:
    profile = Profile(node.ros_name.value, node.namespace.value)
    for port in node.visible_ports:
        profile.allow(port.kind, port.full_name)
    if not node.implementation.in_process:
        _allow_usual(profile, node)
        return profile
    offers = node.introspection
    if offers.rosout:
        profile.allow(PortKind.PUBLISHER, "/rosout")
    if offers.parameters:
        profile.allow(PortKind.PUBLISHER, "/parameter_events")
        profile.allow(PortKind.SERVICE, *PARAMETER_SERVICES)
    if offers.type_description:
        profile.allow(PortKind.SERVICE, "get_type_description")
    if offers.logger_services:
        profile.allow(PortKind.SERVICE, *LOGGER_SERVICES)
    if offers.lifecycle_services:
        profile.allow(PortKind.SERVICE, *LIFECYCLE_SERVICES)
        profile.allow(PortKind.PUBLISHER, "transition_event")
    return profile


def _allow_usual(profile: Profile, node: Node) -> None:
    """Allow what every node of rclcpp and rclpy has."""
    profile.allow(PortKind.PUBLISHER, "/rosout", "/parameter_events")
    profile.allow(PortKind.SUBSCRIPTION, "/parameter_events")
    profile.allow(PortKind.SERVICE, *PARAMETER_SERVICES, "get_type_description")
    if _is_driven(node):
        profile.allow(PortKind.SERVICE, *LIFECYCLE_SERVICES)
        profile.allow(PortKind.PUBLISHER, "transition_event")
    if node.initial_parameters.get(USE_SIM_TIME) is True:
        profile.allow(PortKind.SUBSCRIPTION, "/clock")
