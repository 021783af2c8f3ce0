"""Describe a node class from what its constructor has made."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from composer.bridges.importing.found import FoundNode, FoundParameter, FoundPort
from composer.bridges.importing.live import is_of_every_node
from composer.model import USE_SIM_TIME, PortKind
from composer.model.qos import Durability, History, Liveliness, QosProfile, Reliability
from composer.plan.drift import ObservedEndpoint

_TOPIC_KINDS = (PortKind.PUBLISHER, PortKind.SUBSCRIPTION)


def describe_constructed(text: str, found: Mapping[str, Any]) -> FoundNode:
    """Return the node of a class ``module:Class`` from its description as JSON."""
    name, namespace = found["name"], found["namespace"]
    own = f"{namespace}/{name}"
    parameters = tuple(
        FoundParameter(key, str(settings["type"]), settings["value"], _without(settings))
        for key, settings in found["parameters"].items()
        if not is_of_every_node(key) and key != USE_SIM_TIME and settings.get("value") is not None
    )
    return FoundNode(
        name=name,
        keys={"class": text},
        ports=tuple(_ports(found["ports"], own, namespace)),
        parameters=parameters,
        comments=(f"From the constructor of {text}, by 'compose import class --construct'.",),
    )


def _without(settings: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in settings.items() if key not in ("type", "value")}


def _ports(found: Iterable[Mapping[str, Any]], own: str, namespace: str) -> Iterable[FoundPort]:
    """Yield the ports, with names that are below the namespace written relative to it."""
    seen: set[tuple[PortKind, str]] = set()
    for item in found:
        kind, name = PortKind(item["kind"]), item["name"]
        is_known = (kind, name) in seen or ObservedEndpoint(kind, name, item["type"]).is_for_tools
        if not is_known:
            seen.add((kind, name))
            qos = _profile(item["qos"]) if kind in _TOPIC_KINDS else None
            private, relative = name.removeprefix(own), name.removeprefix(f"{namespace}/")
            shown = f"~{private}" if name.startswith(f"{own}/") else relative
            yield FoundPort(kind, shown, item["type"], qos)


def _profile(item: Mapping[str, Any]) -> QosProfile:
    """Return a profile; what the middleware decides has the default of rclpy."""
    kinds = {
        "history": History,
        "reliability": Reliability,
        "durability": Durability,
        "liveliness": Liveliness,
    }
    values: dict[str, Any] = {
        name: kinds[name](value) if name in kinds else value
        for name, value in item.items()
        if name not in kinds or value in {member.value for member in kinds[name]}
    }
    return QosProfile(**values)
