"""What expressions in the source of a class are, as far as syntax shows it."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.fast_dataclass import dataclass
from composer.python_code.source import Function, Module
from composer.python_code.source.method_body import dotted
from composer.qos import PRESETS, Durability, History, Liveliness, QosProfile, Reliability
from composer.tree import Plain

_MAXIMUM_STEPS = 8
_MAXIMUM_ITEMS = 1000
_FOLDERS = ("msg", "srv", "action")
_QOS_NAMES = {
    "rclpy.qos.qos_profile_sensor_data": "sensor_data",
    "rclpy.qos.qos_profile_services_default": "services_default",
    "rclpy.qos.qos_profile_parameters": "parameters",
    "rclpy.qos.qos_profile_system_default": "system_default",
    "rclpy.qos.QoSPresetProfiles.SENSOR_DATA.value": "sensor_data",
    "rclpy.qos.QoSPresetProfiles.SERVICES_DEFAULT.value": "services_default",
    "rclpy.qos.QoSPresetProfiles.PARAMETERS.value": "parameters",
    "rclpy.qos.QoSPresetProfiles.SYSTEM_DEFAULT.value": "system_default",
}
#: The enumerations of rclpy's policies; each has two names.
_POLICIES = {
    "history": History,
    "reliability": Reliability,
    "durability": Durability,
    "liveliness": Liveliness,
}
_DURATIONS = {
    "deadline": "deadline_ms",
    "lifespan": "lifespan_ms",
    "liveliness_lease_duration": "liveliness_lease_duration_ms",
}


class NotLiteral(Exception):
    """Only running the code would show the value. The text is the code."""


@dataclass(frozen=True, slots=True)
class Scope:
    """Where an expression is: in a method of a class of a module."""

    module: Module
    cls: ast.ClassDef
    method: Function

    def full_name(self, node: ast.expr) -> str:
        """Return the full dotted name of an expression, imports resolved; "" for other ones."""
        first, dot, rest = dotted(node).partition(".")
        imported = self.module.imports.get(first)
        if imported is None:
            return f"{first}{dot}{rest}"
        origin = f"{imported.module}.{imported.name}" if imported.name else imported.module
        if not imported.name and imported.module.startswith(f"{first}."):
            origin = first  # import package.module binds package
        return f"{origin}{dot}{rest}"

    def literal(self, node: ast.expr) -> Plain:
        """Return the value of an expression. Raises NotLiteral."""
        found = self.followed(node)
        match found:
            case ast.Constant(value=bool() | int() | float() | str() | None):
                return found.value  # type: ignore[return-value]
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                value = self.literal(operand)
                if isinstance(value, int | float) and not isinstance(value, bool):
                    return -value
            case ast.List(elts=items) | ast.Tuple(elts=items) if len(items) <= _MAXIMUM_ITEMS:
                return [self.literal(item) for item in items]
        raise NotLiteral(ast.unparse(node)[:80])

    def text(self, node: ast.expr) -> str:
        """Return the text that an expression is. Raises NotLiteral."""
        value = self.literal(node)
        if not isinstance(value, str):
            raise NotLiteral(ast.unparse(node)[:80])
        return value

    def interface(self, node: ast.expr) -> str:
        """Return the interface that an expression names: ``std_msgs/msg/String``.

        Raises NotLiteral.
        """
        parts = self.full_name(self.followed(node)).split(".")
        if len(parts) == 3 and parts[1] in _FOLDERS:
            return "/".join(parts)
        raise NotLiteral(ast.unparse(node)[:80])

    def known_interface(self, node: ast.expr) -> str | None:
        """Return the interface that an expression names, None if it names none."""
        try:
            return self.interface(node)
        except NotLiteral:
            return None

    def qos(self, node: ast.expr) -> QosProfile:
        """Return the QoS profile that an expression is. Raises NotLiteral."""
        preset = _QOS_NAMES.get(self.full_name(node))
        if preset is not None:
            return PRESETS[preset]
        found = self.followed(node)
        match found:
            case ast.Constant(value=int() as depth) if depth is not True and depth is not False:
                return QosProfile(depth=depth)
            case ast.Call(func=function, args=[], keywords=keywords):
                if self.full_name(function) == "rclpy.qos.QoSProfile":
                    return self._profile(keywords)
            case ast.Name() | ast.Attribute() if self.full_name(found) in _QOS_NAMES:
                return PRESETS[_QOS_NAMES[self.full_name(found)]]
        raise NotLiteral(ast.unparse(node)[:80])

    def _profile(self, keywords: list[ast.keyword]) -> QosProfile:
        values: dict[str, object] = {}
        for keyword in keywords:
            name = keyword.arg or ""
            if name == "depth":
                values[name] = self.literal(keyword.value)
            elif name in _POLICIES:
                values[name] = self._policy(name, keyword.value)
            elif name in _DURATIONS:
                values[_DURATIONS[name]] = self._duration_ms(keyword.value)
            elif name != "avoid_ros_namespace_conventions":
                raise NotLiteral(ast.unparse(keyword.value)[:80])
        return QosProfile(**values)  # type: ignore[arg-type]

    def _policy(self, name: str, node: ast.expr) -> object:
        value = dotted(self.followed(node)).rpartition(".")[2].lower()
        kind = _POLICIES[name]
        if value not in {item.value for item in kind}:
            raise NotLiteral(ast.unparse(node)[:80])
        return kind(value)

    def _duration_ms(self, node: ast.expr) -> float:
        found = self.followed(node)
        if isinstance(found, ast.Call) and self.full_name(found.func) == "rclpy.duration.Duration":
            given = {item.arg: self.literal(item.value) for item in found.keywords if item.arg}
            numbers = [given.get(name, 0) for name in ("seconds", "nanoseconds")]
            if not found.args and all(isinstance(item, int | float) for item in numbers):
                seconds, nanoseconds = numbers
                return float(seconds) * 1e3 + float(nanoseconds) * 1e-6  # type: ignore[arg-type]
        raise NotLiteral(ast.unparse(node)[:80])

    def followed(self, node: ast.expr) -> ast.expr:
        """Return the expression that a name stands for, if it is assigned once."""
        for _ in range(_MAXIMUM_STEPS):
            assigned = self._assigned(dotted(node))
            if assigned is None:
                return node
            node = assigned
        raise NotLiteral(ast.unparse(node)[:80])

    def _assigned(self, name: str) -> ast.expr | None:
        """Return the only value that is assigned to a name, or None."""
        if not name:
            return None
        places: tuple[ast.AST, ...] = (self.method, self.module.tree)
        prefix, _, last = name.rpartition(".")
        if prefix in ("self", self.cls.name):
            places, name = (self.cls,), last
        elif prefix:
            return None
        for place in places:
            values = list(_values(place, name, of_self=prefix == "self"))
            if values:
                return values[0] if len(values) == 1 else None
        return None


def _values(place: ast.AST, name: str, *, of_self: bool) -> Iterator[ast.expr | None]:
    """Yield what is assigned to a name in a place; None for what only running would show."""
    whole = isinstance(place, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef)
    nodes = ast.walk(place) if whole else iter(getattr(place, "body", ()))
    for node in nodes:
        match node:
            case (
                ast.Assign(targets=[target], value=value)
                | ast.AnnAssign(target=target, value=ast.expr() as value)
            ):
                if _is_target(target, name, of_self=of_self):
                    yield value
                elif _changes(target, name, of_self=of_self):
                    yield None
            case ast.AugAssign(target=target) | ast.For(target=target):
                if _is_target(target, name, of_self=of_self):
                    yield None
            case ast.arg(arg=argument) if argument == name and not of_self:
                yield None


def _is_target(target: ast.expr, name: str, *, of_self: bool) -> bool:
    if isinstance(target, ast.Name):
        return target.id == name  # of a class: an attribute that self has too
    return of_self and dotted(target) == f"self.{name}"


def _changes(target: ast.expr, name: str, *, of_self: bool) -> bool:
    """Return whether a target is a part of the value, as in ``qos.depth = 5``."""
    if isinstance(target, ast.Attribute | ast.Subscript):
        return _is_target(target.value, name, of_self=of_self)
    return False
