"""The channels and services that clients are offered."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Any

from composer.base.fast_dataclass import dataclass
from composer.dashboard.feeds import Feed
from composer.dashboard.foxglove.encoding import CDR, SCHEMA_ENCODING, Schemas
from composer.dashboard.protocol.outbox import Update
from composer.model import PortKind

if TYPE_CHECKING:
    from composer.dashboard.observing.topics import Topology

_CLOCK, _CLOCK_TYPE = "/clock", "rosgraph_msgs/msg/Clock"
_PERIOD_S = 0.2


@dataclass(frozen=True, slots=True)
class Offer:
    """A topic with one of its types, or a service; ``data`` is what describes it to clients."""

    id: int
    name: str
    type: str
    data: Mapping[str, Any]

    def as_data(self) -> dict[str, Any]:
        """Return the offer as it is sent."""
        return {"id": self.id, **self.data}


#: What is offered, by its number.
Offers = Mapping[int, Offer]


@dataclass(frozen=True, slots=True)
class Contents:
    """Everything that is offered at one time.

    ``unknown`` has the types that are not installed, with a name of each.
    """

    channels: Offers = field(default_factory=dict)
    services: Offers = field(default_factory=dict)
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
        unknown: dict[str, str] = {}
        topics = {(name, end.type) for name, ends in topology.of_topics.items() for _, end in ends}
        servers = {
            (end.name, end.type)
            for node in topology.visible
            for end in topology.nodes[node]
            if end.kind is PortKind.SERVICE
        }
        self.current = Contents(
            channels=self._offers(before.channels, topics, self._channel, unknown),
            services=self._offers(before.services, servers, self._service, unknown),
            unknown=unknown,
            has_clock=any(
                end.kind is PortKind.PUBLISHER and end.type == _CLOCK_TYPE
                for _, end in topology.of_topics.get(_CLOCK, ())
            ),
        )

    def _offers(
        self,
        before: Offers,
        keys: Iterable[tuple[str, str]],
        describe: Callable[[str, str], Mapping[str, Any] | None],
        unknown: dict[str, str],
    ) -> Offers:
        """Return what is offered of these names and types; add the others to ``unknown``."""
        known = {(item.name, item.type): item for item in before.values()}
        offers: dict[int, Offer] = {}
        for name, type_name in sorted(keys):
            offer = known.get((name, type_name))
            if offer is None:
                data = describe(name, type_name)
                if data is None:
                    unknown[type_name] = name
                    continue
                offer = Offer(next(self._numbers), name, type_name, data)
            offers[offer.id] = offer
        return offers

    def _channel(self, topic: str, type_name: str) -> Mapping[str, Any] | None:
        schema = self._schemas.message(type_name)
        return None if schema is None else {"topic": topic, **_encoded(type_name, schema)}

    def _service(self, name: str, type_name: str) -> Mapping[str, Any] | None:
        schemas = self._schemas.service(type_name)
        if schemas is None:
            return None
        parts = zip(("Request", "Response"), schemas, strict=True)
        described = {key.lower(): _encoded(f"{type_name}_{key}", schema) for key, schema in parts}
        return {"name": name, "type": type_name, **described}


def _encoded(name: str, schema: str) -> dict[str, str]:
    return {
        "encoding": CDR,
        "schemaName": name,
        "schemaEncoding": SCHEMA_ENCODING,
        "schema": schema,
    }


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


def changes(before: Offers, now: Offers) -> tuple[list[int], list[Offer]]:
    """Return the numbers of what is gone, and what is new."""
    gone = [number for number in before if number not in now]
    return gone, [item for number, item in now.items() if number not in before]
