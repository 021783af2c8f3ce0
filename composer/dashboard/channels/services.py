"""``services``: all services and actions with the nodes that provide or use them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from composer.dashboard.channels.topics import is_installed
from composer.dashboard.declared import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.protocol.messages import Values, to_json
from composer.dashboard.protocol.outbox import Update
from composer.model import PortKind

if TYPE_CHECKING:
    from composer.dashboard.observing.topology import Topology
    from composer.dashboard.ros_side import RosGraphSide


class ServicesFeed(Feed):
    """The list, again when it changes."""

    def __init__(self, values: Values, declared: Declared | None) -> None:
        """Read the parameters of the channel. Raises BadRequestError."""
        self._hidden, self._chosen = values.flag("hidden"), values.text("chosen", "")
        values.end()
        self._declared = declared
        self._ros: RosGraphSide
        self._revision = -1

    def start(self, ros: RosGraphSide) -> None:
        """Begin with an empty list."""
        self._ros = ros
        self._revision = -1

    def poll(self) -> Iterator[Update]:
        """Yield the list if it is new."""
        topology = self._ros.observed.topology()
        if topology.revision == self._revision:
            return
        self._revision = topology.revision
        services = self._found(topology, PortKind.SERVICE, PortKind.CLIENT)
        actions = self._found(topology, PortKind.ACTION_SERVER, PortKind.ACTION_CLIENT)
        yield Update(to_json({"services": services, "actions": actions}))

    def _found(
        self, topology: Topology, server: PortKind, client: PortKind
    ) -> list[dict[str, Any]]:
        found: dict[str, dict[str, Any]] = {}
        for node in topology.visible:
            for end in topology.nodes[node]:
                if end.kind not in (server, client):
                    continue
                is_hidden = end.is_for_tools or topology.is_for_tools(end.name)
                if is_hidden and not self._hidden and end.name != self._chosen:
                    continue
                item = found.setdefault(
                    end.name, {"name": end.name, "types": [], "servers": [], "clients": []}
                )
                if end.type not in item["types"]:
                    item["types"].append(end.type)
                item["servers" if end.kind is server else "clients"].append(node)
        for item in found.values():
            item["installed"] = all(map(is_installed, item["types"]))
        return [found[name] for name in sorted(found)]
