"""What diagrams say about nodes, ports and channels: short labels, and all details."""

from __future__ import annotations

import math
from collections.abc import Mapping

from composer.graph.diagram import Details
from composer.graph.scene import SceneChannel, SceneEndpoint
from composer.model import (
    DEFAULT_EXECUTOR,
    ChannelKind,
    DynamicTransform,
    Node,
    Port,
    StaticTransform,
    Timer,
)
from composer.qos import PRESETS, History, QosProfile
from composer.tree import Plain

_SOURCES = {
    ChannelKind.TOPIC: "publishers",
    ChannelKind.SERVICE: "servers",
    ChannelKind.ACTION: "servers",
}
_SINKS = {
    ChannelKind.TOPIC: "subscriptions",
    ChannelKind.SERVICE: "clients",
    ChannelKind.ACTION: "clients",
}


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
    for name in ("deadline_ms", "lifespan_ms", "liveliness_lease_duration_ms"):
        value = getattr(profile, name)
        if value is not None:
            facts[name] = value
    return facts


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
        "parameters": {
            parameter.name.value: None if parameter.value is None else _json(parameter.value.value)
            for parameter in (*node.parameters, *node.undeclared_parameters)
        },
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
    return _non_empty(
        {
            "name": channel.name,
            "type": types[0] if len(types) == 1 else types,
            _SOURCES[channel.kind]: [*map(_end, channel.sources)],
            _SINKS[channel.kind]: [*map(_end, channel.sinks)],
        }
    )


def _end(endpoint: SceneEndpoint) -> str:
    return f"{endpoint.node.full_name}.{endpoint.port.name}"


def _non_empty(facts: dict[str, Plain]) -> Details:
    return tuple((name, value) for name, value in facts.items() if value not in (None, [], {}))


def _json(value: Plain) -> Plain:
    """Return ``value`` with YAML text for numbers that JSON does not have: ``.nan``, ``.inf``."""
    match value:
        case float() if not math.isfinite(value):
            return str(value).replace("nan", ".nan").replace("inf", ".inf")
        case list():
            return [_json(item) for item in value]
        case _:
            return value
