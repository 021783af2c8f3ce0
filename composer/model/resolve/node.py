"""Resolve a node of a system: its declaration, names and parameter values."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from collections.abc import Mapping as Map
from functools import partial
from pathlib import Path

from composer.base.fast_dataclass import dataclass, replace
from composer.base.source import Located
from composer.language.tree import (
    Entry,
    Mapping,
    Sequence,
    Tree,
    choice,
    entries,
    flag,
    is_opaque,
    key,
    mapping,
    plain_text,
    text,
    text_or_opaque,
    value_or,
)
from composer.model import (
    DRIVEN_BY_MANAGER,
    USE_SIM_TIME,
    Dependency,
    LogLevel,
    Node,
    ParameterSection,
    Port,
    PrimaryState,
    Remapping,
    Supervision,
    Transforms,
)
from composer.model.assembly.limits import SystemLimits
from composer.model.names import expand_name, remapped_name
from composer.model.qos_overrides import override_names, with_overrides
from composer.model.resolve.connections import PortConnection, PortConnections, connection_of
from composer.model.resolve.declaration import (
    Declaration,
    Implementation,
    read_external,
    refined,
    refines,
    unknown_keys,
)
from composer.model.resolve.node_settings import (
    NodeNames,
    node_names,
    read_introspection,
    read_supervision,
)
from composer.model.resolve.node_types import DeclaredNode, NodeTypeLoader
from composer.model.resolve.overrides import Overrides
from composer.model.resolve.parameter_files import ParameterFiles
from composer.model.resolve.parameters import GivenValues, node_parameters

_NOTHING = Declaration("", Implementation(), (), (), (), (), ())


@dataclass(frozen=True, slots=True)
class SystemContext:
    """What resolving any node of a system needs."""

    namespace: Located[str]  # absolute
    types: NodeTypeLoader
    port_connections: PortConnections
    overrides: Overrides
    supervision: Supervision
    introspection: Tree | None
    parameter_files: ParameterFiles
    parameter_sections: Callable[[], tuple[ParameterSection, ...]]  # all of the files
    use_sim_time: tuple[Entry, ...]  # the system's entry, if it has one
    processes: Map[str, Located[str]]  # by the nodes that they name
    limits: SystemLimits


def resolve_node(entry: Entry, context: SystemContext) -> Node:
    """Return the node of an entry in ``nodes``."""
    tree = mapping(entry)
    type_entry = tree.entry("type")
    type_name = text(type_entry.value) if type_entry is not None else None
    path = context.types.find(type_name) if type_name is not None else None
    made = _declared(tree, type_entry, path, context.types)
    declared = made.declaration
    context.limits.count("declared", declared.size, entry.key.span)
    external = read_external(tree.entry("external"))
    is_passed_on = external is not None and not declared.only_declared
    gets_undeclared = declared.gets_undeclared or is_passed_on
    names = node_names(entry, tree, declared.implementation.executable, context.namespace)
    remappings = _remappings(tree.get("remappings"))
    ports = place_ports(declared.ports, names, remappings, context.port_connections)
    transforms = place_transforms(declared.transforms, names, remappings)
    # The process has one subscription on /tf, which is not a node's.
    transform_ports = () if transforms is None else transforms.publishers
    given = _given_values(entry.name, tree, declared, context, (*ports, *transform_ports))
    parameters = node_parameters(
        declared.parameters,
        given,
        names,
        gets_undeclared=gets_undeclared,
        is_program=declared.implementation.executable is not None and external is None,
    )
    context.limits.count("sections", parameters.sections_from_files, entry.key.span)
    unknown = unknown_keys(made.tree, tree) if made.complete and made.files else ()
    is_complete = made.complete and not declared.implementation.conflicting
    overridden = partial(with_overrides, overrides=parameters.qos_overrides)
    if transforms is not None:
        transforms = replace(transforms, ports=tuple(map(overridden, transforms.ports)))
    container = text(tree.get("container"))
    lifecycle = tree.get("lifecycle")
    lifecycle = lifecycle if isinstance(lifecycle, Mapping) else Mapping((), tree.span)
    return Node(
        name=key(entry),
        namespace=names.namespace,
        own_name=names.own_name,
        span=entry.key.span,
        type_name=text_or_opaque(type_entry.value, type_entry.key.span) if type_entry else None,
        type_found=type_entry is None or path is not None,
        type_files=made.files,
        own_type_name=text(made.tree.get("node")) if made.files else None,
        description=plain_text(tree.get("description")) or declared.description,
        behavior=declared.implementation.behavior,
        hosted_class=declared.implementation.hosted_class,
        executable=declared.implementation.executable,
        component=declared.implementation.component,
        container=container,
        conflicting=declared.implementation.conflicting,
        external=external,
        inner_nodes=names.inner,
        keeps_names=names.are_kept,
        gets_undeclared=gets_undeclared,
        parameters=parameters.parameters,
        overridden_parameters=parameters.overridden_parameters,
        undeclared_parameters=parameters.undeclared_parameters,
        parameter_sections=parameters.sections,
        ports=tuple(map(overridden, ports)),
        timers=declared.timers,
        transforms=transforms,
        state=declared.state,
        reactions=declared.reactions,
        remappings=remappings,
        executor=text(tree.get("executor")),
        process=text(tree.get("process")) or context.processes.get(entry.name),
        log_level=choice(tree.get("log_level"), LogLevel),
        required=flag(tree.get("required"), default=True),
        depends_on=_dependencies(lifecycle.get("depends_on"), container),
        autostart=choice(lifecycle.get("autostart"), PrimaryState),
        supervision=read_supervision(lifecycle, context.supervision),
        introspection=DRIVEN_BY_MANAGER
        if external or declared.implementation.executable or declared.implementation.component
        else read_introspection(
            declared.introspection, context.introspection, tree.get("introspection")
        ),
        unknown=(*unknown, *(parameters.unknown if is_complete else ())),
        given=tuple(map(key, tree)),
        complete=is_complete,
    )


def _given_values(
    name: str, tree: Mapping, declared: Declaration, context: SystemContext, ports: tuple[Port, ...]
) -> GivenValues:
    """Return the values for the parameters of the node with the key ``name`` and these ports."""
    is_inline = tree.entry("type") is None
    declares_clock = any(item.name.value == USE_SIM_TIME for item in declared.parameters)
    clock = () if is_inline and declares_clock else context.use_sim_time
    files = context.parameter_files
    own = {} if is_inline else {item.name: item for item in entries(tree.get("parameters"))}
    command_line = context.overrides.by_node.get(name, {})
    may_override = declared.parameters or own or command_line or files.sections
    return GivenValues(
        {item.name: item for item in clock},
        files,
        context.parameter_sections,
        own,
        command_line,
        frozenset(override_names(ports)) if may_override else frozenset(),
    )


def place_ports(
    ports: Iterable[Port],
    names: NodeNames,
    remappings: Iterable[Remapping],
    port_connections: PortConnections,
) -> tuple[Port, ...]:
    """Return the ports with their full names in a node, and the settings of connections.

    The name of a connection takes precedence over a remapping, which takes precedence over the
    declared name.
    """

    def expanded(ros_name: str) -> str:
        return (
            ros_name
            if is_opaque(ros_name)
            else expand_name(ros_name, names.ros_name, names.namespace.value)
        )

    renamed: dict[str, str] = {}
    for remapping in remappings:
        source = remapped_name(remapping.source.value)
        renamed.setdefault(expanded(source), expanded(remapping.target.value))
    return tuple(
        _place_port(port, port_connections.get((names.key, port.name.value), ()), expanded, renamed)
        for port in ports
    )


def place_transforms(
    transforms: Transforms | None, names: NodeNames, remappings: Iterable[Remapping]
) -> Transforms | None:
    """Return the frames of a node with the full names of /tf and /tf_static in that node."""
    if transforms is None:
        return None
    return replace(transforms, ports=place_ports(transforms.ports, names, remappings, {}))


def _place_port(
    port: Port,
    port_connections: Iterable[PortConnection],
    expanded: Callable[[str], str],
    renamed: dict[str, str],
) -> Port:
    connection = connection_of(port, port_connections)
    if connection is None:
        own = expanded(port.ros_name.value)
        return replace(port, full_name=renamed.get(own, own))
    return replace(
        port,
        full_name=connection.full_name,
        connected_at=connection.span,
        qos=connection.qos or port.qos,
        declared_qos=None if connection.qos is None else port.qos,
        delivery=connection.delivery,
        isolation=connection.isolation or port.isolation,
    )


def _declared(
    tree: Mapping, type_entry: Entry | None, path: Path | None, types: NodeTypeLoader
) -> DeclaredNode:
    """Return what a node declares, or its type in the file ``path`` with the node's changes."""
    if type_entry is None:
        return DeclaredNode(tree, types.folders, types.declare(tree))
    variables, span = tree.get("variables"), type_entry.value.span
    made = None if path is None else types.instantiate(path, variables, span)
    if made is None:
        return DeclaredNode(tree, types.folders, _NOTHING, complete=False)
    if not refines(tree):
        return made
    # Compiling the type's expressions again only repeats diagnostics, which are deduplicated.
    return replace(made, declaration=types.declare(refined(made.tree, tree), made.folders))


def _remappings(tree: Tree | None) -> tuple[Remapping, ...]:
    found = ((key(entry), text(entry.value)) for entry in entries(tree))
    return tuple(Remapping(source, target) for source, target in found if target is not None)


def _dependencies(tree: Tree | None, container: Located[str] | None) -> tuple[Dependency, ...]:
    """Return the dependencies, from a list of names or a map of names to states.

    A component needs its container active.
    """
    if isinstance(tree, Mapping):
        declared = [
            Dependency(key(entry), value_or(choice(entry.value, PrimaryState), PrimaryState.ACTIVE))
            for entry in tree
        ]
    else:
        names = (text(item) for item in (tree.items if isinstance(tree, Sequence) else ()))
        declared = [Dependency(name) for name in names if name is not None]
    if container is None:
        return tuple(declared)
    others = (item for item in declared if item.node.value != container.value)
    return (Dependency(container, is_container=True), *others)
