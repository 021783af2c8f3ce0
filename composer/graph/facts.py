"""What diagrams say about nodes, ports and channels: short labels, and all details."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping

from composer.graph.diagram import Details
from composer.graph.scene import SceneChannel, SceneEndpoint
from composer.language.document.scalars import with_json_numbers
from composer.language.tree import Plain
from composer.model import (
    DEFAULT_EXECUTOR,
    ChannelKind,
    DynamicTransform,
    Node,
    Port,
    StaticTransform,
    Timer,
)
from composer.model.qos import DISCOVERED_POLICIES, DURATIONS, PRESETS, History, QosProfile
from composer.python_code.lookup import find_behavior
from composer.python_code.nodes import published_port
from composer.python_code.syntax import Method
from composer.rules.analysis.rates import causes_in_node, published_by_method

#: Statements that may leave a method early.
_EXITS = (ast.Return, ast.Raise, ast.Yield, ast.YieldFrom, ast.Assert)


def short_type(interface: str) -> str:
    """Return ``Odometry`` for ``nav_msgs/msg/Odometry``."""
    return interface.rpartition("/")[2] or interface


def rate(hertz: float) -> str:
    """Return a rate such as ``10 Hz``, with three significant digits."""
    return f"{float(f'{hertz:.3g}'):g} Hz"


def qos_label(profile: QosProfile) -> str:
    """Return the name of a matching preset, else the policies of the profile."""
    for name in ("command", "sensor_data", "state"):
        if profile == PRESETS[name]:
            return name
    return ", ".join([profile.reliability, profile.durability, _history(profile), *_times(profile)])


def discovered_qos_label(profile: QosProfile) -> str:
    """Return the policies that discovery reports, which exclude history and depth."""
    return ", ".join([profile.reliability, profile.durability, *_times(profile)])


def qos_facts(profile: QosProfile) -> dict[str, Plain]:
    """Return all policies that are set, with the keys of YAML."""
    facts: dict[str, Plain] = {
        "reliability": profile.reliability.value,
        "durability": profile.durability.value,
        "history": profile.history.value,
    }
    if profile.history is History.KEEP_LAST:
        facts["depth"] = profile.depth
    facts["liveliness"] = profile.liveliness.value
    for name in DURATIONS:
        value = getattr(profile, name)
        if value is not None:
            facts[name] = value
    return facts


def discovered_qos_facts(profile: QosProfile) -> dict[str, Plain]:
    """Return the policies that discovery reports."""
    return {
        name: value for name, value in qos_facts(profile).items() if name in DISCOVERED_POLICIES
    }


def _history(profile: QosProfile) -> str:
    if profile.history is History.KEEP_ALL:
        return "keep_all"
    return f"keep_last {profile.depth}"


def _times(profile: QosProfile) -> list[str]:
    times = {
        "deadline": profile.deadline_ms,
        "lifespan": profile.lifespan_ms,
        "lease": profile.liveliness_lease_duration_ms,
    }
    return [f"{name} {value:g} ms" for name, value in times.items() if value is not None]


def timer_rate_hz(node: Node, timer: Timer) -> float | None:
    """Return the timer's rate with the parameters the node starts with; None if unknown."""
    period_s = node.period_s(timer)
    return None if period_s is None else 1.0 / period_s


def node_facts(node: Node, rates_hz: Mapping[str, float]) -> Details:
    """Return the details of a node with its ports and parameters.

    ``rates_hz`` are the known publishing rates by port.
    """
    facts: dict[str, Plain] = {
        "full_name": node.full_name,
        "type": node.type_name.value if node.type_name is not None else None,
        "behavior": node.behavior.text.value if node.behavior is not None else None,
        "class": node.hosted_class.reference.text.value if node.hosted_class is not None else None,
        "executable": str(node.executable) if node.executable is not None else None,
        "component": str(node.component) if node.component is not None else None,
        "container": node.container.value if node.container is not None else None,
        "inner_nodes": [*node.inner_nodes],
        "external": node.external is not None or None,
        "executor": _executor(node),
        "process": node.process.value if node.process is not None else None,
        "description": node.description or None,
        "declared_at": str(node.span),
        "depends_on": [
            f"{dependency.node.value} ({dependency.state})" for dependency in node.depends_on
        ],
        "ports": [dict(port_facts(port, rates_hz.get(port.name.value))) for port in node.ports],
        "timers": [
            {"name": timer.name.value, "rate_hz": timer_rate_hz(node, timer)}
            for timer in node.timers
        ],
        "parameters": with_json_numbers(
            {
                parameter.name.value: None if parameter.value is None else parameter.value.value
                for parameter in (*node.parameters, *node.undeclared_parameters)
            }
        ),
    }
    return _non_empty(facts)


def transform_facts(declared: StaticTransform | DynamicTransform) -> Details:
    """Return the details of a transform: its values, or where they come from."""
    facts: dict[str, Plain] = {}
    if isinstance(declared, DynamicTransform):
        facts["from"] = None if declared.source is None else declared.source.value
    elif declared.from_code:
        facts["from_code"] = True
    elif declared.values is not None:
        translation, rotation = declared.values.value
        facts["translation_m"] = [*translation]
        facts["quaternion"] = [round(value, 6) for value in rotation]
    facts["declared_at"] = str(declared.child.span)
    return _non_empty(facts)


def _executor(node: Node) -> str | None:
    if not node.implementation.in_process:
        return None
    return node.executor.value if node.executor is not None else DEFAULT_EXECUTOR


def port_facts(port: Port, rate_hz: float | None) -> Details:
    """Return the details of a port."""
    facts: dict[str, Plain] = {
        "port": port.name.value,
        "kind": port.kind.value,
        "name": port.full_name,
        "type": port.interface.value,
        "qos": qos_facts(port.qos.profile),
        "qos_explicit": port.qos.explicit,
        "timeout_ms": port.timeout_ms.value if port.timeout_ms is not None else None,
        "description": port.description or None,
        "rate_hz": rate_hz,
        "declared_at": str(port.span),
    }
    return _non_empty(facts)


def channel_facts(channel: SceneChannel) -> Details:
    """Return the details of a topic, service or action."""
    types: list[Plain] = [*channel.types]
    names = ("servers", "clients")
    if channel.kind is ChannelKind.TOPIC:
        names = ("publishers", "subscriptions")
    return _non_empty(
        {
            "name": channel.name,
            "type": types[0] if len(types) == 1 else types,
            names[0]: [*map(_end, channel.sources)],
            names[1]: [*map(_end, channel.sinks)],
        }
    )


def _end(endpoint: SceneEndpoint) -> str:
    return f"{endpoint.node.full_name}.{endpoint.port.name}"


def _non_empty(facts: dict[str, Plain]) -> Details:
    return tuple((name, value) for name, value in facts.items() if value not in (None, [], {}))


def publishing_rates_hz(node: Node) -> dict[str, float]:
    """Return, by port, the rate of the one timer that publishes to it each time it fires.

    What a behavior does is read from its text. Ports are left out where it depends on a
    condition, or where several timers or anything else publish to them.
    """
    source = None if node.behavior is None else find_behavior(node.behavior)
    methods = () if source is None else source.methods
    by_method = {} if source is None else published_by_method(source)
    handlers = {method.name: method for method in methods}
    rates: dict[str, float] = {}
    for port, callbacks in causes_in_node(node, source, by_method).items():
        timer = callbacks[0].timer if len(callbacks) == 1 else None
        if timer is not None and _always_publishes(timer, port, handlers):
            hertz = timer_rate_hz(node, timer)
            if hertz is not None:
                rates[port] = hertz
    return rates


def _always_publishes(timer: Timer, port: str, handlers: Mapping[str, Method]) -> bool:
    if timer.reaction is not None:
        return timer.reaction.when is None and any(
            send.port.value == port for send in timer.reaction.publish
        )
    handler = handlers.get(f"on_{timer.name.value}")
    return handler is not None and [*_unconditional(handler)].count(port) == 1


def _unconditional(method: Method) -> Iterator[str]:
    """Yield the ports that unconditional statements publish to, up to the first possible exit."""
    names: dict[ast.expr, str] = {call.node: call.name for call in method.calls}
    for statement in method.node.body if method.node is not None else ():
        if isinstance(statement, ast.Expr):
            port = published_port(names.get(statement.value, ""))
            if port is not None:
                yield port
        elif any(isinstance(inner, _EXITS) for inner in ast.walk(statement)):
            return
