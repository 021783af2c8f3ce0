"""``topics``: all topics with their endpoints, and figures of those on the screen."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from composer.dashboard.channels.image import COMPRESSED, IMAGE
from composer.dashboard.declared import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.protocol.messages import Values, to_json
from composer.dashboard.protocol.outbox import Update
from composer.graph.facts import qos_facts
from composer.model import PortKind

if TYPE_CHECKING:
    from composer.dashboard.observing.topology import Topology
    from composer.dashboard.ros_side import RosGraphSide
    from composer.plan.drift import ObservedEndpoint

_MAX_MEASURED = 40
#: Discovery does not report these.
_UNKNOWN_QOS = ("history", "depth")


class TopicsFeed(Feed):
    """The list of topics when it changes, and figures every second."""

    def __init__(self, values: Values, declared: Declared | None) -> None:
        """Read the parameters of the channel. Raises BadRequestError."""
        del declared
        self._measure = list(dict.fromkeys(values.texts("measure", _MAX_MEASURED)))
        self._hidden, self._chosen = values.flag("hidden"), values.text("chosen", "")
        values.end()
        self._ros: RosGraphSide
        self._measured: set[str] = set()
        self._revision = -1
        self._topics: list[dict[str, Any]] = []

    def start(self, ros: RosGraphSide) -> None:
        """Begin with an empty list."""
        self._ros = ros
        self._revision = -1

    def close(self) -> None:
        """Stop measuring."""
        for topic in self._measured:
            self._ros.observed.meters.release(topic)
        self._measured.clear()

    def poll(self) -> Iterator[Update]:
        """Yield the list with figures."""
        topology = self._ros.observed.topology()
        of_topics = topology.of_topics
        if topology.revision != self._revision:
            self._revision = topology.revision
            self._topics = self._listed(topology)
        meters = self._ros.observed.meters
        for topic in self._measure:
            ends = [end for _, end in of_topics.get(topic, [])]
            if topic not in self._measured and meters.acquire(topic, ends):
                self._measured.add(topic)
        meters.poll()
        figures = {topic: meters.figures(topic) for topic in self._measure}
        yield Update(
            to_json(
                {
                    "topics": self._topics,
                    "figures": {
                        topic: asdict(found)
                        for topic, found in figures.items()
                        if found is not None
                    },
                }
            )
        )

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
        "installed": all(map(is_installed, types)),
        "image": types in ([IMAGE], [COMPRESSED]),
    }


def is_installed(type_name: str) -> bool:
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
    if end.qos is None:
        return None
    return {key: value for key, value in qos_facts(end.qos).items() if key not in _UNKNOWN_QOS}
