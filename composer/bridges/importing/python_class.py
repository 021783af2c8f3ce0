"""Describe an rclpy node class from its source, without importing or running it."""

from __future__ import annotations

import ast
from collections.abc import Callable
from dataclasses import field
from functools import partial
from pathlib import Path
from typing import TypeVar

from composer.base.diagnostics import suggestion
from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, SourceFile, Span, shown_path
from composer.bridges.importing import FoundNode, FoundParameter, FoundPort
from composer.bridges.importing.branches import ALWAYS, Condition, conditions_of_calls
from composer.language.tree import Plain
from composer.model import BehaviorReference, PortKind
from composer.model.resolve.parameters import rclpy_type
from composer.project import Project
from composer.python_code.lookup import BehaviorSource, find_behavior
from composer.python_code.modules import nearby_modules
from composer.python_code.scopes import NotLiteral, Scope
from composer.python_code.syntax import Method, scopes_in
from composer.rules.analysis.class_ports import CREATORS, qos_profile

T = TypeVar("T")

_ACTION = ("node", "action_type", "action_name")
#: The classes that create endpoints: their kind, and their arguments in order.
_CLASSES: dict[str, tuple[PortKind, tuple[str, ...]]] = {
    "rclpy.action.ActionServer": (PortKind.ACTION_SERVER, _ACTION),
    "rclpy.action.server.ActionServer": (PortKind.ACTION_SERVER, _ACTION),
    "rclpy.action.ActionClient": (PortKind.ACTION_CLIENT, _ACTION),
    "rclpy.action.client.ActionClient": (PortKind.ACTION_CLIENT, _ACTION),
    # Its QoS profile can only be given by name.
    "message_filters.Subscriber": (
        PortKind.SUBSCRIPTION,
        ("node", "msg_type", "topic", "callback", "qos_profile"),
    ),
}
_TYPES = ("msg_type", "srv_type", "action_type")
_NAMES = ("topic", "srv_name", "action_name")
_DESCRIPTOR = "rcl_interfaces.msg.ParameterDescriptor"
_RANGES = ("rcl_interfaces.msg.FloatingPointRange", "rcl_interfaces.msg.IntegerRange")


class ClassNotFound(Exception):
    """The class cannot be read; ``hint`` says how to proceed."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.hint = hint


def describe_class(text: str, folder: Path) -> tuple[FoundNode, tuple[str, ...]]:
    """Return the node of a class ``module:Class``, and what its source does not show.

    Python looks for the module as for the module of a behavior in ``folder``. Raises ClassNotFound.
    """
    located = Located(text, Span(SourceFile("", text), 1, 1, len(text)))
    source = find_behavior(BehaviorReference(located, folder))
    _check(source, text, folder)
    reader = _ClassReader([], [], [])
    for scope in scopes_in(source.classes):
        reader.read(scope)
    reader.add_conditions()
    reader.add_arguments(source.method("__init__"))
    own_module, own = source.classes[0]
    place = f"{shown_path(own_module.path)}:{own.span.line}"
    comments: tuple[str, ...] = (
        f"From the source of {text} ({place}), by 'compose import class'.",
    )
    if reader.unknown:
        comments += ("Not shown by the source:", *(f"- {item}" for item in reader.unknown))
    node = FoundNode(
        name=reader.name or own.name.lower(),
        keys={"class": text},
        ports=tuple(reader.ports),
        parameters=tuple(reader.parameters),
        comments=comments,
    )
    return node, tuple(reader.unknown)


def _check(source: BehaviorSource, text: str, folder: Path) -> None:
    module, _, name = text.partition(":")
    if not module or not name.isidentifier():
        raise ClassNotFound(
            f"'{text}' does not name a class", "for example: demo_nodes_py.topics.talker:Talker"
        )
    if source.problem is not None:
        raise ClassNotFound(f"module '{module}' {source.problem}")
    if not source.module_found:
        raise ClassNotFound(
            f"no Python module named '{module}'",
            nearby_modules(module, (folder, *Project.at(folder).node_folders)).hint
            or "Python looks for it in this folder, in the folders of node types, and on its path",
        )
    if not source.class_found:
        raise ClassNotFound(
            f"module '{module}' has no class '{name}'", suggestion(name, source.class_names)
        )
    if not source.classes:
        raise ClassNotFound(
            f"the source of '{text}' cannot be read: it is compiled or made at run time",
            "run it as the 'class' of a node, and use 'compose import live'",
        )
    if source.complete and not source.is_rclpy_node:
        raise ClassNotFound(
            f"class '{name}' is not derived from rclpy's Node",
            "a class without ROS is the 'behavior' of a node type: 'compose new node' creates one",
        )


@dataclass(slots=True)
class _ClassReader:
    """Collects what the methods of a class create."""

    ports: list[FoundPort]
    parameters: list[FoundParameter]
    unknown: list[str]
    name: str = ""
    #: The place and the condition, if any, of each call that creates something.
    created: dict[str, list[tuple[str, Condition]]] = field(default_factory=dict)
    _condition: Condition = ALWAYS  # of the call that is being read

    def read(self, scope: Scope) -> None:
        """Read one method."""
        conditions = {} if scope.function is None else conditions_of_calls(scope.function)
        for call in scope.nodes:
            if not isinstance(call, ast.Call):
                continue
            place = f"{Path(scope.source.path).name}:{call.lineno}"
            self._condition = conditions.get(call, ALWAYS)
            name = call.func.attr if isinstance(call.func, ast.Attribute) else ""
            full_name = scope.full_name(call.func)
            if name in CREATORS and full_name.startswith("self."):
                self._add_port(scope, call, CREATORS[name], place)
            elif full_name in _CLASSES:
                self._add_port(scope, call, _CLASSES[full_name], place)
            elif full_name == "self.declare_parameter":
                self._add_parameter(scope, call, place)
            elif full_name == "self.declare_parameters":
                self._add_parameters(scope, call, place)
            elif name == "__init__" and not self.name:
                self.name = _node_name(scope, call)

    def _add_port(
        self, scope: Scope, call: ast.Call, creator: tuple[PortKind, tuple[str, ...]], place: str
    ) -> None:
        kind, names = creator
        given = _arguments(call, names)
        try:
            (type_node,) = (given[name] for name in _TYPES if name in given)
            (name_node,) = (given[name] for name in _NAMES if name in given)
            port_type, port_name = scope.interface(type_node), scope.text(name_node)
        except NotLiteral as error:
            self.unknown.append(f"{place}: a {kind}, because of {error}")
            return
        except ValueError:
            self.unknown.append(f"{place}: a {kind} with unusual arguments")
            return
        qos = None
        if "qos_profile" in given:
            qos = self._try(
                lambda: qos_profile(scope, given["qos_profile"]),
                f"{place}: the QoS of {kind} {port_name}",
            )
        self._remember(f"{kind} {port_name}", place)
        types = {(port.kind, port.name): port.type for port in self.ports}
        known = types.setdefault((kind, port_name), "")
        if not known:
            self.ports.append(FoundPort(kind, port_name, port_type, qos, comments=(place,)))
        elif known != port_type:
            self.unknown.append(f"{place}: which type the {kind} {port_name} has: also {port_type}")

    def _remember(self, what: str, place: str) -> None:
        self.created.setdefault(what, []).append((place, self._condition))

    def add_conditions(self) -> None:
        """List what no call creates without a condition, nor calls on opposite conditions."""
        for what, calls in self.created.items():
            conditions = {condition for _, condition in calls}
            opposites = {condition.negated for condition in conditions}
            if ALWAYS not in conditions and conditions.isdisjoint(opposites):
                place, condition = calls[0]
                self.unknown.append(f"{place}: whether there is the {what}: only if {condition}")

    def add_arguments(self, constructor: Method | None) -> None:
        """List the arguments of the constructor that have no default."""
        if constructor is not None and constructor.known:
            place = f"{Path(constructor.span.file.path).name}:{constructor.span.line}"
            self.unknown.extend(
                f"{place}: the value of argument {name} of the constructor: 'arguments' sets it"
                for names in constructor.required
                for name in names
            )

    def _add_parameter(self, scope: Scope, call: ast.Call, place: str) -> None:
        given = _arguments(call, ("name", "value", "descriptor"))
        if "name" not in given:
            return
        name = self._try(lambda: scope.text(given["name"]), f"{place}: a parameter")
        if name is None:
            return
        settings: dict[str, Plain] = {}
        if "descriptor" in given:
            settings = _settings(scope, given["descriptor"])
        self._declare(scope, name, given.get("value"), settings, place)

    def _add_parameters(self, scope: Scope, call: ast.Call, place: str) -> None:
        given = _arguments(call, ("namespace", "parameters"))
        listed = given.get("parameters")
        if not isinstance(listed, ast.List | ast.Tuple):
            self.unknown.append(f"{place}: parameters that are not listed there")
            return
        prefix = self._try(
            lambda: scope.text(given["namespace"]) if "namespace" in given else "",
            f"{place}: the prefix of parameters",
        )
        for item in listed.elts if prefix is not None else ():
            if isinstance(item, ast.Tuple) and item.elts:
                name = self._try(partial(scope.text, item.elts[0]), f"{place}: a parameter")
                value = item.elts[1] if len(item.elts) > 1 else None
                if name is not None:
                    full = f"{prefix}.{name}" if prefix else name
                    self._declare(scope, full, value, {}, place)

    def _declare(
        self,
        scope: Scope,
        name: str,
        value_node: ast.expr | None,
        settings: dict[str, Plain],
        place: str,
    ) -> None:
        value: Plain = None
        kind = None if value_node is None else _type_of_node(scope, value_node)
        if kind is None and value_node is not None:
            value = self._try(
                lambda: scope.literal(value_node), f"{place}: the default of parameter {name}"
            )
            kind = rclpy_type(value)
        if kind is None:
            self.unknown.append(f"{place}: the type of parameter {name}")
        else:
            self._remember(f"parameter {name}", place)
            self._add_first(FoundParameter(name, kind, value, settings, (place,)))

    def _add_first(self, parameter: FoundParameter) -> None:
        if parameter.name not in {item.name for item in self.parameters}:
            self.parameters.append(parameter)

    def _try(self, read: Callable[[], T], what: str) -> T | None:
        """Return ``read()``; if only running would show it, add ``what`` to the unknown."""
        try:
            return read()
        except NotLiteral as error:
            self.unknown.append(f"{what}, because of {error}")
            return None


def _arguments(call: ast.Call, names: tuple[str, ...]) -> dict[str, ast.expr]:
    found = dict(zip(names, call.args, strict=False))
    found |= {item.arg: item.value for item in call.keywords if item.arg in names}
    return found


def _node_name(scope: Scope, call: ast.Call) -> str:
    """Return the name of the node that ``super().__init__(...)`` sets, or an empty text."""
    given = _arguments(call, ("node_name",))
    try:
        name = scope.text(given["node_name"])
    except (NotLiteral, KeyError):
        return ""
    return name if name.isidentifier() else ""


def _settings(scope: Scope, node: ast.expr) -> dict[str, Plain]:
    """Return the keys of a parameter that its descriptor shows."""
    node = scope.followed(node)
    if not isinstance(node, ast.Call) or scope.full_name(node.func) != _DESCRIPTOR:
        return {}
    settings: dict[str, Plain] = {}
    for keyword in node.keywords:
        try:
            if keyword.arg in ("floating_point_range", "integer_range"):
                settings |= _range(scope, keyword.value)
            elif keyword.arg in ("description", "read_only"):
                settings[keyword.arg] = scope.literal(keyword.value)
        except NotLiteral:
            continue
    return settings


def _range(scope: Scope, node: ast.expr) -> dict[str, Plain]:
    match scope.followed(node):
        case ast.List(elts=[ast.Call() as call]) if scope.full_name(call.func) in _RANGES:
            given = {item.arg: scope.literal(item.value) for item in call.keywords}
            keys = {"minimum": "from_value", "maximum": "to_value", "step": "step"}
            return {
                key: given[name]
                for key, name in keys.items()
                if name in given and not (key == "step" and not given[name])
            }
    return {}


def _type_of_node(scope: Scope, node: ast.expr) -> str | None:
    """Return the type of ``Parameter.Type.DOUBLE``, in lower case, or None."""
    name = scope.full_name(node)
    return name.rpartition(".")[2].lower() if ".Parameter.Type." in name else None
