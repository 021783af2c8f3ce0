"""``topics``: all topics, with figures of those on the screen; ``services``: and actions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from composer.dashboard.channels.messages import COMPRESSED, IMAGE
from composer.dashboard.context import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.protocol.messages import Values, to_json
from composer.dashboard.protocol.outbox import Update
from composer.graph.facts import discovered_qos_facts
from composer.model import PortKind

if TYPE_CHECKING:
    from composer.dashboard.observing.topics import Topology
    from composer.plan.drift import ObservedEndpoint

_MAX_MEASURED = 40


class TopicsFeed(Feed):
    """The list of topics when it changes, and figures every second."""

    def __init__(self, values: Values, _: Declared | None) -> None:
        self._measured = list(dict.fromkeys(values.texts("measure", _MAX_MEASURED)))
        self._hidden, self._chosen = values.flag("hidden"), values.text("chosen", "")
        self._listed_of: Topology | None = None
        self._topics: list[dict[str, Any]] = []

    def start(self) -> None:
        """Measure the topics on the screen."""
        self.ros.meters.acquire(self._measured)
        self.resources.callback(self.ros.meters.release, self._measured)

    def poll(self) -> Iterator[Update]:
        """Yield the list with figures."""
        topology, meters = self.ros.topology(), self.ros.meters
        if topology is not self._listed_of:
            self._listed_of, self._topics = topology, self._listed(topology)
        meters.poll()
        figures = {topic: meters.figures(topic) for topic in self._measured}
        known = {topic: asdict(item) for topic, item in figures.items() if item is not None}
        yield Update(to_json({"topics": self._topics, "figures": known}))

    def _listed(self, topology: Topology) -> list[dict[str, Any]]:
        return [
            _topic(name, ends)
            for name, ends in sorted(topology.of_topics.items())
            if self._hidden
            or name == self._chosen
            or not (topology.is_for_tools(name) or all(end.is_for_tools for _, end in ends))
        ]


def _topic(name: str, ends: list[tuple[str, ObservedEndpoint]]) -> dict[str, Any]:
    types = sorted({end.type for _, end in ends})
    return {
        "name": name,
        "types": types,
        "publishers": [_end(*item) for item in ends if item[1].kind is PortKind.PUBLISHER],
        "subscriptions": [_end(*item) for item in ends if item[1].kind is PortKind.SUBSCRIPTION],
        "installed": all(map(_is_installed, types)),
        "image": types in ([IMAGE], [COMPRESSED]),
    }


def _is_installed(type_name: str) -> bool:
    """Return whether the class of an interface can be imported."""
    from composer.runtime.ros.messages import MessageError, interface_class

    try:
        interface_class(type_name)
    except MessageError:
        return False
    return True


def _end(node: str, end: ObservedEndpoint) -> dict[str, Any]:
    return {"node": node, "type": end.type, "qos": shown_qos(end)}


def shown_qos(end: ObservedEndpoint) -> dict[str, Any] | None:
    """Return the policies of an endpoint that discovery reports."""
    return None if end.qos is None else discovered_qos_facts(end.qos)


class ServicesFeed(Feed):
    """All services and actions with the nodes that provide or use them, again after a change."""

    def __init__(self, values: Values, _: Declared | None) -> None:
        self._hidden, self._chosen = values.flag("hidden"), values.text("chosen", "")
        self._listed_of: Topology | None = None

    def poll(self) -> Iterator[Update]:
        """Yield the list if it is new."""
        topology = self.ros.topology()
        if topology is self._listed_of:
            return
        self._listed_of = topology
        services = self._listed(topology, PortKind.SERVICE, PortKind.CLIENT)
        actions = self._listed(topology, PortKind.ACTION_SERVER, PortKind.ACTION_CLIENT)
        yield Update(to_json({"services": services, "actions": actions}))

    def _listed(
        self, topology: Topology, server: PortKind, client: PortKind
    ) -> list[dict[str, Any]]:
        items: dict[str, dict[str, Any]] = {}
        for node in topology.visible:
            for end in topology.nodes[node]:
                if end.kind not in (server, client):
                    continue
                is_hidden = end.is_for_tools or topology.is_for_tools(end.name)
                if is_hidden and not self._hidden and end.name != self._chosen:
                    continue
                item = items.setdefault(
                    end.name, {"name": end.name, "types": [], "servers": [], "clients": []}
                )
                if end.type not in item["types"]:
                    item["types"].append(end.type)
                item["servers" if end.kind is server else "clients"].append(node)
        for item in items.values():
            item["installed"] = all(map(_is_installed, item["types"]))
        return [items[name] for name in sorted(items)]
