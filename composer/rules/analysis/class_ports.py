"""The ports that the classes of nodes create, with their QoS, read from their source."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import partial

from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.model import PortKind
from composer.model.qos import DURATIONS, PRESETS, WORDS, QosProfile
from composer.python_code.lookup import BehaviorSource
from composer.python_code.nodes import calls_on_self
from composer.python_code.scopes import NotLiteral, Scope
from composer.python_code.syntax import scopes_in
from composer.python_code.trees import argument, dotted, span_of, walk

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
#: Packages whose functions take a node and declare no parameters of the class.
_OF_ROS = frozenset({"message_filters", "rclpy", "tf2_ros"})
#: How rclpy names its profiles: ``qos_profile_sensor_data`` or ``QoSPresetProfiles.SENSOR_DATA``.
_QOS_NAMES = {
    name: preset
    for preset in ("sensor_data", "services_default", "parameters", "system_default")
    for name in (
        f"rclpy.qos.qos_profile_{preset}",
        f"rclpy.qos.QoSPresetProfiles.{preset.upper()}.value",
    )
}
_DURATIONS = {name.removesuffix("_ms"): name for name in DURATIONS}


@dataclass(frozen=True, slots=True)
class CreatedPort:
    """A port that a class creates; what its source does not show is None.

    ``overridable`` are the policies that parameters may override, as fields of QosProfile.
    """

    kind: PortKind
    name: str | None
    interface: str | None
    qos: QosProfile | None
    span: Span
    overridable: frozenset[str]


def created_ports(source: BehaviorSource) -> Iterator[CreatedPort]:
    """Yield the ports that a class creates by methods of Node."""
    for scope, call, method in calls_on_self(source):
        if method not in CREATORS:
            continue
        kind, names = CREATORS[method]
        has_qos = "qos_profile" in names
        qos = argument(call, names.index("qos_profile"), "qos_profile") if has_qos else None
        yield CreatedPort(
            kind,
            scope.known(scope.text, argument(call, 1, names[1])),
            scope.known(scope.interface, argument(call, 0, names[0])),
            scope.known(partial(qos_profile, scope), qos),
            span_of(call, scope.source),
            _overridable(scope, call),
        )


def _overridable(scope: Scope, call: ast.Call) -> frozenset[str]:
    """Return the policies of ``qos_overriding_options``; all if the source does not show them."""
    options = [item.value for item in call.keywords if item.arg == "qos_overriding_options"]
    if not options:
        return frozenset()
    kinds: ast.expr | None = None
    match scope.known(scope.followed, options[0]):
        case ast.Call(func=ast.Attribute(attr="with_default_policies")):
            return frozenset({"history", "depth", "reliability"})
        case ast.Call() as created:
            kinds = scope.known(scope.followed, argument(created, 0, "policy_kinds"))
    if isinstance(kinds, ast.List | ast.Tuple | ast.Set):
        names = [item.attr.lower() for item in kinds.elts if isinstance(item, ast.Attribute)]
        if len(names) == len(kinds.elts):
            return frozenset(_DURATIONS.get(name, name) for name in names)
    return frozenset({*WORDS, *_DURATIONS.values(), "depth"})


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


def all_created_ports(source: BehaviorSource) -> list[CreatedPort] | None:
    """Return all ports that a class creates by methods of Node.

    None: it may create others, since a name is computed, or since other code gets the node.
    """
    if not source.complete or passes_node_on(source, frozenset({"rclpy"})):
        return None
    ports = list(created_ports(source))
    if any(port.name is None for port in ports):
        return None
    mentioned = sum(
        isinstance(node, ast.Attribute) and node.attr in CREATORS
        for module in source.own_modules
        for node in walk(module.tree.body)
    )
    return ports if mentioned == len(ports) else None


def qos_profile(scope: Scope, node: ast.expr) -> QosProfile:
    """Return the QoS profile that an expression is. Raises NotLiteral."""
    value = scope.followed(node)
    preset = _QOS_NAMES.get(scope.full_name(value))
    if preset is not None:
        return PRESETS[preset]
    match value:
        case ast.Constant(value=int() as depth) if depth is not True and depth is not False:
            return QosProfile(depth=depth)
        case ast.Call(func=function, args=[], keywords=keywords):
            if scope.full_name(function) == "rclpy.qos.QoSProfile":
                return _profile(scope, keywords)
    raise NotLiteral(node)


def _profile(scope: Scope, keywords: list[ast.keyword]) -> QosProfile:
    values: dict[str, object] = {}
    for keyword in keywords:
        name = keyword.arg or ""
        if name == "depth":
            values[name] = scope.literal(keyword.value)
        elif name in WORDS:
            values[name] = _policy(scope, name, keyword.value)
        elif name in _DURATIONS:
            values[_DURATIONS[name]] = _duration_ms(scope, keyword.value)
        elif name != "avoid_ros_namespace_conventions":
            raise NotLiteral(keyword.value)
    return QosProfile(**values)  # type: ignore[arg-type]


def _policy(scope: Scope, name: str, node: ast.expr) -> object:
    value = dotted(scope.followed(node)).rpartition(".")[2].lower()
    kind = WORDS[name]
    if value not in {item.value for item in kind}:
        raise NotLiteral(node)
    return kind(value)


def _duration_ms(scope: Scope, node: ast.expr) -> float | None:
    """Return a duration; None if it is 0, which is unlimited."""
    value = scope.followed(node)
    if not isinstance(value, ast.Call) or value.args:
        raise NotLiteral(node)
    if scope.full_name(value.func) != "rclpy.duration.Duration":
        raise NotLiteral(node)
    given = {item.arg: scope.literal(item.value) for item in value.keywords if item.arg}
    seconds, nanoseconds = (given.get(name, 0) for name in ("seconds", "nanoseconds"))
    if not (isinstance(seconds, int | float) and isinstance(nanoseconds, int | float)):
        raise NotLiteral(node)
    return (float(seconds) * 1e3 + float(nanoseconds) * 1e-6) or None
