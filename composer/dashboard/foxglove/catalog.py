"""The channels and services that clients are offered, and who uses them."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Any, TypeVar

from composer.base.fast_dataclass import dataclass
from composer.dashboard.feeds import Feed
from composer.dashboard.foxglove.encoding import CDR, SCHEMA_ENCODING, Schemas
from composer.dashboard.protocol.outbox import Update
from composer.model import PortKind

if TYPE_CHECKING:
    from composer.dashboard.observing.topology import Topology

T = TypeVar("T")

_CLOCK = ("/clock", "rosgraph_msgs/msg/Clock")
_PERIOD_S = 0.2

#: The nodes at each name, sorted.
Users = Mapping[str, tuple[str, ...]]


@dataclass(frozen=True, slots=True)
class Channel:
    """A topic with one of its types."""

    id: int
    topic: str
    type: str
    schema: str

    def as_data(self) -> dict[str, Any]:
        """Return the channel as it is sent."""
        return {
            "id": self.id,
            "topic": self.topic,
            "encoding": CDR,
            "schemaName": self.type,
            "schemaEncoding": SCHEMA_ENCODING,
            "schema": self.schema,
        }


@dataclass(frozen=True, slots=True)
class OfferedService:
    """A service with the schemas of its request and response."""

    id: int
    name: str
    type: str
    request: str
    response: str

    def as_data(self) -> dict[str, Any]:
        """Return the service as it is sent."""
        return {
            "id": self.id,
            "name": self.name,
            "type": self.type,
            "request": self._part("Request", self.request),
            "response": self._part("Response", self.response),
        }

    def _part(self, name: str, schema: str) -> dict[str, str]:
        return {
            "encoding": CDR,
            "schemaName": f"{self.type}_{name}",
            "schemaEncoding": SCHEMA_ENCODING,
            "schema": schema,
        }


@dataclass(frozen=True, slots=True)
class Contents:
    """Everything that is offered at one time.

    ``unknown`` has the types that are not installed, with a name of each.
    """

    channels: Mapping[int, Channel] = field(default_factory=dict)
    services: Mapping[int, OfferedService] = field(default_factory=dict)
    publishers: Users = field(default_factory=dict)
    subscribers: Users = field(default_factory=dict)
    providers: Users = field(default_factory=dict)
    unknown: Mapping[str, str] = field(default_factory=dict)
    has_clock: bool = False


class Catalog:
    """The current contents. A number is never used again for something else."""

    def __init__(self, schemas: Schemas) -> None:
        self._schemas = schemas
        self._numbers = itertools.count(1)
        self.current = Contents()

    def update(self, topology: Topology) -> None:
        """Offer what is in the ROS graph."""
        before = self.current
        channels = {(item.topic, item.type): item for item in before.channels.values()}
        services = {(item.name, item.type): item for item in before.services.values()}
        topics, servers = _topics(topology), _servers(topology)
        unknown: dict[str, str] = {}
        offered = [channels.get(key) or self._channel(*key) for key in topics]
        unknown |= {key[1]: key[0] for key, item in zip(topics, offered, strict=True) if not item}
        served = [services.get(key) or self._service(*key) for key in servers]
        unknown |= {key[1]: key[0] for key, item in zip(servers, served, strict=True) if not item}
        publishers = _users(topology, PortKind.PUBLISHER)
        self.current = Contents(
            channels={item.id: item for item in offered if item is not None},
            services={item.id: item for item in served if item is not None},
            publishers=publishers,
            subscribers=_users(topology, PortKind.SUBSCRIPTION),
            providers=_users(topology, PortKind.SERVICE),
            unknown=unknown,
            has_clock=_CLOCK in topics and _CLOCK[0] in publishers,
        )

    def _channel(self, topic: str, type_name: str) -> Channel | None:
        schema = self._schemas.message(type_name)
        return None if schema is None else Channel(next(self._numbers), topic, type_name, schema)

    def _service(self, name: str, type_name: str) -> OfferedService | None:
        found = self._schemas.service(type_name)
        return found and OfferedService(next(self._numbers), name, type_name, *found)


class CatalogFeed(Feed):
    """Keeps the catalog up to date; its updates only say that there is something new."""

    period_s = _PERIOD_S

    def __init__(self, catalog: Catalog) -> None:
        self._catalog = catalog
        self._offered: Topology | None = None

    def poll(self) -> Iterator[Update]:
        """Yield an update if the ROS graph has changed."""
        topology = self.ros.topology()
        if topology is not self._offered:
            self._offered = topology
            self._catalog.update(topology)
            yield Update("")


def changes(before: Mapping[int, T], now: Mapping[int, T]) -> tuple[list[int], list[T]]:
    """Return the numbers of what is gone, and what is new."""
    gone = [number for number in before if number not in now]
    return gone, [item for number, item in now.items() if number not in before]


def graph_update(before: Contents, now: Contents) -> dict[str, Any] | None:
    """Return the changes of the connection graph as they are sent, None without any.

    What has lost its last user, but has others, is sent with an empty list.
    """
    topics = now.publishers.keys() | now.subscribers.keys()
    removed_topics = (before.publishers.keys() | before.subscribers.keys()) - topics
    update: dict[str, Any] = {
        "publishedTopics": _changed(before.publishers, now.publishers, topics, "publisherIds"),
        "subscribedTopics": _changed(before.subscribers, now.subscribers, topics, "subscriberIds"),
        "advertisedServices": _changed(
            before.providers, now.providers, now.providers.keys(), "providerIds"
        ),
        "removedTopics": sorted(removed_topics),
        "removedServices": sorted(before.providers.keys() - now.providers.keys()),
    }
    return {"op": "connectionGraphUpdate", **update} if any(update.values()) else None


def _changed(before: Users, now: Users, names: Any, key: str) -> list[dict[str, Any]]:
    return [
        {"name": name, key: list(now.get(name, ()))}
        for name in sorted(names)
        if before.get(name, ()) != now.get(name, ())
    ]


def _topics(topology: Topology) -> list[tuple[str, str]]:
    ends = topology.of_topics.items()
    return sorted({(topic, end.type) for topic, found in ends for _, end in found})


def _servers(topology: Topology) -> list[tuple[str, str]]:
    return sorted(
        {
            (end.name, end.type)
            for node in topology.visible
            for end in topology.nodes[node]
            if end.kind is PortKind.SERVICE
        }
    )


def _users(topology: Topology, kind: PortKind) -> Users:
    found: dict[str, set[str]] = {}
    for node in topology.visible:
        for end in topology.nodes[node]:
            if end.kind is kind:
                found.setdefault(end.name, set()).add(node)
    return {name: tuple(sorted(nodes)) for name, nodes in sorted(found.items())}
