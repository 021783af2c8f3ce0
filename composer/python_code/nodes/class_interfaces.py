"""What the classes of nodes call on their object, and the parameters that they declare so."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.fast_dataclass import dataclass
from composer.python_code.source import BehaviorSource, Scope, scopes_in
from composer.python_code.source.trees import argument, span_of, walk
from composer.resolve.declarations.parameters import rclpy_type
from composer.source import Located

_DECLARING = frozenset({"declare_parameter", "declare_parameters"})
#: With one of these, parameters exist that the class does not declare by name.
UNDECLARED = frozenset(
    {"allow_undeclared_parameters", "automatically_declare_parameters_from_overrides"}
)
#: Packages whose functions take a node and declare no parameters of the class.
_OF_ROS = frozenset({"message_filters", "rclpy", "tf2_ros"})


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
    texts = [module.source.text for module in source.own_modules]
    is_open = any(name in text for name in UNDECLARED for text in texts)
    # A method that is passed on, or called for another object, may declare anything.
    mentions = sum(isinstance(node, ast.Attribute) and node.attr in _DECLARING for node in nodes)
    parameters = DeclaredParameters({}, source.complete and source.class_found and not is_open)
    for scope, call, method in calls_on_self(source):
        if method in _DECLARING:
            mentions -= 1
            _declare(scope, call, method, parameters)
    parameters.is_complete = parameters.is_complete and mentions == 0
    return parameters


def _declare(scope: Scope, call: ast.Call, method: str, parameters: DeclaredParameters) -> None:
    """Add the parameters that a call declares."""
    prefix: str | None = ""
    items = [(argument(call, 0, "name"), argument(call, 1, "value"))]
    if method == "declare_parameters":
        prefix = scope.known(scope.text, argument(call, 0, "namespace"))
        listed = argument(call, 1, "parameters")
        pairs = listed.elts if isinstance(listed, ast.List | ast.Tuple) else [ast.Tuple(elts=[])]
        items = [_pair(item) for item in pairs]
    for name_node, default in items:
        name = scope.known(scope.text, name_node)
        if name is None or prefix is None:
            parameters.is_complete = False
            continue
        name = f"{prefix}.{name}" if prefix else name
        is_certain = name not in parameters.types and not _may_change(call)
        type_ = rclpy_type(scope.known(scope.literal, default)) if is_certain else None
        where = span_of(call, scope.source)
        parameters.types[name] = Located(type_, where) if type_ is not None else None


def _pair(item: ast.expr) -> tuple[ast.expr | None, ast.expr | None]:
    match item:
        case ast.Tuple(elts=[name, default, *_]):
            return name, default
        case ast.Tuple(elts=[name]):
            return name, None
    return None, None


def passes_node_on(source: BehaviorSource, harmless: frozenset[str] = _OF_ROS) -> bool:
    """Return whether a class passes its object to other code than some packages."""
    return any(_passes_on(scope, harmless) for scope in scopes_in(source.classes))


def _passes_on(scope: Scope, harmless: frozenset[str]) -> bool:
    uses = 0
    for node in scope.nodes:
        match node:
            case ast.Name(id="self"):
                uses += 1
            case ast.Attribute(value=ast.Name(id="self")):
                uses -= 1
            case ast.Call() if scope.full_name(node.func).partition(".")[0] in harmless:
                given = [*node.args, *(keyword.value for keyword in node.keywords)]
                uses -= sum(getattr(item, "id", None) == "self" for item in given)
    return uses > 0


def calls_on_self(source: BehaviorSource) -> Iterator[tuple[Scope, ast.Call, str]]:
    """Yield the calls of methods of the object in the methods of a class, with their names."""
    for scope in scopes_in(source.classes):
        for node in scope.nodes:
            match node:
                case ast.Call(func=ast.Attribute(value=ast.Name(id="self"), attr=name)):
                    yield scope, node, name


def _may_change(call: ast.Call) -> bool:
    """Return whether a declaration may allow values of several types."""
    match argument(call, 2, "descriptor"):
        case None:
            return False
        case ast.Call(keywords=keywords):
            return any(item.arg in (None, "dynamic_typing") for item in keywords)
    return True
