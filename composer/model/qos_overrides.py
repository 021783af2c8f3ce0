"""QoS overrides: parameters that change policies of a node's publishers and subscriptions.

Their names are ``qos_overrides.<topic>.<publisher or subscription>.<policy>`` and their values
those of ``rclpy.qos_overriding_options``; durations are in nanoseconds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from composer.base.fast_dataclass import dataclass, replace
from composer.base.source import Located
from composer.model.ports import Parameter, ParameterType, Port, PortKind, Qos
from composer.model.qos import DURATIONS, WORDS

PREFIX = "qos_overrides."
_NANOSECONDS = 1e6  # per millisecond
#: Longer durations are rmw's infinite duration, and so is zero, its unspecified one.
_LONGEST_NS = 10**18


@dataclass(frozen=True, slots=True)
class _Policy:
    """A policy: the field of QosProfile, and how to read the value of a parameter."""

    field: str
    read: Callable[[Any], object]
    choices: tuple[str, ...] = ()


def _milliseconds(nanoseconds: int) -> float | None:
    return nanoseconds / _NANOSECONDS if 0 < nanoseconds < _LONGEST_NS else None


#: ``avoid_ros_namespace_conventions`` is left out: nodes of a system have topics of ROS.
_POLICIES: Mapping[str, _Policy] = {
    "depth": _Policy("depth", int),
    **{name: _Policy(name, kind, tuple(map(str, kind))) for name, kind in WORDS.items()},
    **{name.removesuffix("_ms"): _Policy(name, _milliseconds) for name in DURATIONS},
}
_OVERRIDABLE = {
    PortKind.PUBLISHER: tuple(_POLICIES),
    PortKind.SUBSCRIPTION: tuple(name for name in _POLICIES if name != "lifespan"),
}


def overridable_policies(kind: PortKind) -> tuple[str, ...]:
    """Return the policies of a kind of ports that rclpy allows to override: topics only."""
    return _OVERRIDABLE.get(kind, ())


def override_names(ports: Iterable[Port]) -> Iterator[str]:
    """Yield the names of all parameters that override a policy of one of the ports."""
    for port in ports:
        policies = overridable_policies(port.kind)
        prefix = _name(port, "") if policies else ""
        for policy in policies:
            yield prefix + policy


def override_parameter(given: Parameter) -> Parameter:
    """Return the read-only parameter of an override with the type and choices of its policy.

    As for rclpy, case does not matter in names of values.
    """
    policy = _POLICIES[given.name.value.rpartition(".")[2]]
    value = given.value
    span = given.span if value is None else value.span
    if value is not None and isinstance(value.value, str):
        value = Located(value.value.lower(), value.span)
    return replace(
        given,
        type=Located(ParameterType.STRING if policy.choices else ParameterType.INTEGER, span),
        value=value,
        default=value,
        choices=Located(policy.choices, span) if policy.choices else None,
        minimum=None if policy.choices else Located(0, span),
        read_only=True,
    )


def with_overrides(port: Port, overrides: Mapping[str, Parameter]) -> Port:
    """Return the port with the policies that ``overrides``, by name, set to valid values."""
    if not overrides:
        return port
    values: dict[str, Located[object]] = {}
    for name in overridable_policies(port.kind):
        parameter, policy = overrides.get(_name(port, name)), _POLICIES[name]
        given = parameter.value if parameter is not None else None
        if given is not None and _is_valid(given.value, policy):
            values[policy.field] = given.map(policy.read)
    if not values:
        return port
    own = port.declared_qos
    declared_qos = None if own is None else _overlaid(own, values)
    return replace(port, qos=_overlaid(port.qos, values), declared_qos=declared_qos)


def _name(port: Port, policy: str) -> str:
    return f"{PREFIX}{port.full_name}.{port.kind.value}.{policy}"


def _is_valid(value: object, policy: _Policy) -> bool:
    if policy.choices:
        return value in policy.choices
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _overlaid(qos: Qos, values: Mapping[str, Located[object]]) -> Qos:
    changes: dict[str, Any] = {name: item.value for name, item in values.items()}
    spans = dict(qos.policy_spans) | {name: item.span for name, item in values.items()}
    return replace(
        qos,
        profile=replace(qos.profile, **changes),
        policy_spans=tuple(spans.items()),
        inline=qos.inline | values.keys(),
        overridden=frozenset(values),
    )
