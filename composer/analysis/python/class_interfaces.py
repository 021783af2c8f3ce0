"""The parameters and ports that the classes of nodes create, read from their source."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.analysis.python.hosted_classes import ClassOfNode
from composer.behavior_source import BehaviorSource, Module, top_package
from composer.behavior_source.method_body import argument, dotted
from composer.behavior_source.spans import span_of
from composer.behavior_source.traversal import walk
from composer.behavior_types.syntax.bindings import nodes_of
from composer.behavior_types.syntax.names import full_name, interface_name
from composer.behavior_types.syntax.self_attributes import escapes
from composer.fast_dataclass import dataclass
from composer.model import PortKind
from composer.resolve.declarations.parameters import rclpy_type
from composer.source import Located, Span

_TOPIC = ("msg_type", "topic", "qos_profile")
_SERVICE = ("srv_type", "srv_name")
#: The methods that create ports: their kind, and their arguments in order.
CREATORS: dict[str, tuple[PortKind, tuple[str, ...]]] = {
    "create_publisher": (PortKind.PUBLISHER, _TOPIC),
    "create_lifecycle_publisher": (PortKind.PUBLISHER, _TOPIC),
    "create_subscription": (
        PortKind.SUBSCRIPTION,
        ("msg_type", "topic", "callback", "qos_profile"),
    ),
    "create_service": (PortKind.SERVICE, _SERVICE),
    "create_client": (PortKind.CLIENT, _SERVICE),
}


@dataclass(frozen=True, slots=True)
class CreatedPort:
    """A port that a class creates with a constant type and name."""

    kind: PortKind
    name: str
    interface: Located[str]


def parameter_types(found: ClassOfNode) -> dict[str, Located[str]]:
    """Return the types of the parameters that a class declares once, with a constant default."""
    types: dict[str, Located[str]] = {}
    several: set[str] = set()
    for module, call in _calls(found.source):
        if not isinstance(call.func, ast.Attribute) or call.func.attr != "declare_parameter":
            continue
        name, default = argument(call, 0, "name"), argument(call, 1, "value")
        if not isinstance(name, ast.Constant) or not isinstance(name.value, str):
            continue
        type_ = _type_of(default) if default is not None else None
        if name.value in types or type_ is None or _may_change(call):
            several.add(name.value)
        else:
            types[name.value] = Located(type_, span_of(call, module.source))
    return {name: type_ for name, type_ in types.items() if name not in several}


def created_ports(found: ClassOfNode) -> Iterator[CreatedPort]:
    """Yield the ports that a class creates with a constant type and name."""
    for module, call, kind, type_, name in _creations(found.source):
        interface, rest = interface_name(full_name(dotted(type_), module)) if type_ else ("", "")
        if interface and not rest and isinstance(name, ast.Constant):
            where: Span = span_of(call, module.source)
            yield CreatedPort(kind, str(name.value), Located(interface, where))


def all_created_ports(found: ClassOfNode) -> list[tuple[PortKind, str]] | None:
    """Return the kinds and names of all ports that a class creates by methods of Node.

    None: it may create others, since a name is computed, or since other code gets the node.
    """
    source = found.source
    if not source.complete or escapes(source, lambda full: full.startswith("rclpy.")):
        return None
    ports: list[tuple[PortKind, str]] = []
    for _, _, kind, _, name in _creations(source):
        if not isinstance(name, ast.Constant):
            return None
        ports.append((kind, str(name.value)))
    mentioned = sum(
        isinstance(node, ast.Attribute) and node.attr in CREATORS
        for module in source.own_modules
        for node in walk(module.tree.body)
    )
    return ports if mentioned == len(ports) else None


def _creations(
    source: BehaviorSource,
) -> Iterator[tuple[Module, ast.Call, PortKind, ast.expr | None, ast.expr | None]]:
    """Yield the calls that create ports: their kind, and the arguments for its type and name."""
    for module, call in _calls(source):
        creator = CREATORS.get(call.func.attr) if isinstance(call.func, ast.Attribute) else None
        if creator is not None:
            kind, (of_type, of_name, *_) = creator
            yield module, call, kind, argument(call, 0, of_type), argument(call, 1, of_name)


def _calls(source: BehaviorSource) -> Iterator[tuple[Module, ast.Call]]:
    """Yield the calls of methods of the object in the methods of a class."""
    for module, known in source.classes:
        if top_package(module.path) == "rclpy":
            continue
        for method in known.methods:
            for node in nodes_of(method.node) if method.node is not None else ():
                match node:
                    case ast.Call(func=ast.Attribute(value=ast.Name(id="self"))):
                        yield module, node


def _may_change(call: ast.Call) -> bool:
    """Return whether a declaration may allow values of several types."""
    descriptor = argument(call, 2, "descriptor")
    if descriptor is None:
        return False
    options = (
        {item.arg for item in descriptor.keywords} if isinstance(descriptor, ast.Call) else {None}
    )
    return bool(options & {None, "dynamic_typing"})


def _type_of(default: ast.expr) -> str | None:
    """Return the type of a parameter with a default, None if it is not constant."""
    try:
        return rclpy_type(ast.literal_eval(default))
    except ValueError:
        return None
