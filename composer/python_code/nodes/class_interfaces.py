"""The parameters and ports that the classes of nodes create, read from their source."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from typing import TypeVar

from composer.fast_dataclass import dataclass
from composer.model import PortKind
from composer.python_code.nodes.classes import ClassOfNode
from composer.python_code.source import BehaviorSource
from composer.python_code.source.method_body import argument
from composer.python_code.source.spans import span_of
from composer.python_code.source.traversal import walk
from composer.python_code.source.values import NotLiteral, Scope
from composer.qos import QosProfile
from composer.resolve.declarations.parameters import rclpy_type
from composer.source import Located, Span

T = TypeVar("T")

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
_DECLARING = frozenset({"declare_parameter", "declare_parameters"})
#: With one of these, parameters exist that the class does not declare by name.
_UNDECLARED = frozenset(
    {"allow_undeclared_parameters", "automatically_declare_parameters_from_overrides"}
)
#: Packages whose functions take a node and declare no parameters of the class.
_OF_ROS = frozenset({"message_filters", "rclpy", "tf2_ros"})


@dataclass(frozen=True, slots=True)
class CreatedPort:
    """A port that a class creates; what its source does not show is None."""

    kind: PortKind
    name: str | None
    interface: str | None
    qos: QosProfile | None
    span: Span


def created_ports(node_class: ClassOfNode) -> Iterator[CreatedPort]:
    """Yield the ports that a class creates by methods of Node."""
    for scope, call in _calls(node_class.source):
        creator = CREATORS.get(_called(call))
        if creator is None:
            continue
        kind, names = creator
        has_qos = "qos_profile" in names
        qos = argument(call, names.index("qos_profile"), "qos_profile") if has_qos else None
        yield CreatedPort(
            kind,
            _known(scope.text, argument(call, 1, names[1])),
            _known(scope.interface, argument(call, 0, names[0])),
            _known(scope.qos, qos),
            span_of(call, scope.module.source),
        )


def all_created_ports(node_class: ClassOfNode) -> list[CreatedPort] | None:
    """Return all ports that a class creates by methods of Node.

    None: it may create others, since a name is computed, or since other code gets the node.
    """
    source = node_class.source
    if not source.complete or passes_node_on(source, frozenset({"rclpy"})):
        return None
    ports = list(created_ports(node_class))
    if any(port.name is None for port in ports):
        return None
    mentioned = sum(
        isinstance(node, ast.Attribute) and node.attr in CREATORS
        for module in source.own_modules
        for node in walk(module.tree.body)
    )
    return ports if mentioned == len(ports) else None


@dataclass(slots=True)
class DeclaredParameters:
    """The parameters that a class declares, by name; ``is_complete`` if there are no others.

    The type is None if the source does not show it, or if it may change.
    """

    types: dict[str, Located[str] | None]
    is_complete: bool


def declared_parameters(source: BehaviorSource) -> DeclaredParameters:
    """Return the parameters that a class declares by methods of Node."""
    nodes = [node for module in source.own_modules for node in walk(module.tree.body)]
    is_open = any(isinstance(node, ast.keyword) and node.arg in _UNDECLARED for node in nodes)
    # A method that is passed on, or called for another object, may declare anything.
    mentions = sum(isinstance(node, ast.Attribute) and node.attr in _DECLARING for node in nodes)
    parameters = DeclaredParameters({}, source.complete and source.class_found and not is_open)
    for scope, call in _calls(source):
        if _called(call) in _DECLARING:
            mentions -= 1
            _declare(scope, call, parameters)
    parameters.is_complete = parameters.is_complete and mentions == 0
    return parameters


def _declare(scope: Scope, call: ast.Call, parameters: DeclaredParameters) -> None:
    """Add the parameters that a call declares."""
    prefix: str | None = ""
    items = [(argument(call, 0, "name"), argument(call, 1, "value"))]
    if _called(call) == "declare_parameters":
        prefix = _known(scope.text, argument(call, 0, "namespace"))
        listed = argument(call, 1, "parameters")
        pairs = listed.elts if isinstance(listed, ast.List | ast.Tuple) else [ast.Tuple(elts=[])]
        items = [_pair(item) for item in pairs]
    for name_node, default in items:
        name = _known(scope.text, name_node)
        if name is None or prefix is None:
            parameters.is_complete = False
            continue
        name = f"{prefix}.{name}" if prefix else name
        is_certain = name not in parameters.types and not _may_change(call)
        type_ = rclpy_type(_known(scope.literal, default)) if is_certain else None
        where = span_of(call, scope.module.source)
        parameters.types[name] = Located(type_, where) if type_ is not None else None


def _pair(item: ast.expr) -> tuple[ast.expr | None, ast.expr | None]:
    match item:
        case ast.Tuple(elts=[name, default, *_]):
            return name, default
        case ast.Tuple(elts=[name]):
            return name, None
    return None, None


def passes_node_on(source: BehaviorSource, harmless: frozenset[str] = _OF_ROS) -> bool:
    """Return whether a class passes its object to other code than that of some packages."""
    return any(
        _passes_on(Scope(module, known.node, method.node), harmless)
        for module, known in source.classes_outside_ros
        for method in known.methods
        if method.node is not None
    )


def _passes_on(scope: Scope, harmless: frozenset[str]) -> bool:
    uses = 0
    for node in walk(scope.method.body, closed=(ast.ClassDef,)):
        match node:
            case ast.Name(id="self"):
                uses += 1
            case ast.Attribute(value=ast.Name(id="self")):
                uses -= 1
            case ast.Call() if scope.full_name(node.func).partition(".")[0] in harmless:
                given = [*node.args, *(keyword.value for keyword in node.keywords)]
                uses -= sum(getattr(item, "id", None) == "self" for item in given)
    return uses > 0


def _calls(source: BehaviorSource) -> Iterator[tuple[Scope, ast.Call]]:
    """Yield the calls of methods of the object in the methods of a class."""
    for module, known in source.classes_outside_ros:
        for method in known.methods:
            if method.node is None:
                continue
            scope = Scope(module, known.node, method.node)
            for node in walk(method.node.body, closed=(ast.ClassDef,)):
                match node:
                    case ast.Call(func=ast.Attribute(value=ast.Name(id="self"))):
                        yield scope, node


def _called(call: ast.Call) -> str:
    return call.func.attr if isinstance(call.func, ast.Attribute) else ""


def _known(read: Callable[[ast.expr], T], node: ast.expr | None) -> T | None:
    """Return what an expression is, None if only running the code would show it."""
    try:
        return read(node) if node is not None else None
    except NotLiteral:
        return None


def _may_change(call: ast.Call) -> bool:
    """Return whether a declaration may allow values of several types."""
    match argument(call, 2, "descriptor"):
        case None:
            return False
        case ast.Call(keywords=keywords):
            return any(item.arg in (None, "dynamic_typing") for item in keywords)
    return True
