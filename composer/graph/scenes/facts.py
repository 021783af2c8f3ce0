"""Details of nodes, ports and channels for diagrams."""

from __future__ import annotations

import math
from collections.abc import Mapping

from composer.graph.diagram import Details
from composer.graph.labels import qos_facts
from composer.graph.scenes.rates import timer_rate_hz
from composer.graph.scenes.scene import SceneChannel, SceneEndpoint
from composer.model import (
    DEFAULT_EXECUTOR,
    ChannelKind,
    DynamicTransform,
    Node,
    Port,
    StaticTransform,
)
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
