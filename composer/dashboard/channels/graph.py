"""``graph``: the diagram of the ROS graph or of the system; ``graph.live``: rates in it."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from itertools import islice
from typing import TYPE_CHECKING, Any

from composer.dashboard.context import Declared, required
from composer.dashboard.feeds import Feed
from composer.dashboard.protocol.messages import Values, to_json
from composer.dashboard.protocol.outbox import Update
from composer.runtime.metrics.figures import CountedRate

if TYPE_CHECKING:
    from composer.dashboard.observing.diagrams import Diagram
    from composer.dashboard.observing.topics import Topology
    from composer.runtime.protocol.reports import NodeReport

VIEWS = ("nodes", "connections", "lifecycle", "deployment", "states")
#: The size of the page in pixels, unless a subscription says it.
_WIDTH, _HEIGHT = 1280.0, 800.0
_MIN_SIDE, _MAX_SIDE = 16.0, 16384.0
_DECLARED_ONLY = ("lifecycle", "deployment")
#: Topics without a report are measured, but no more than these.
_MAX_MEASURED = 60
#: While the graph changes.
_SOON_S = 0.1


class PictureFeed(Feed):
    """The diagram on a page, laid out on a worker thread whenever the graph has changed."""

    follows_reports = True  # to wake up together with the other feeds

    def __init__(self, values: Values, declared: Declared | None) -> None:
        width = values.number("width", _WIDTH, _MIN_SIDE, _MAX_SIDE)
        height = values.number("height", _HEIGHT, _MIN_SIDE, _MAX_SIDE)
        self._page = (width, height)
        self._view = values.choice("view", VIEWS, "nodes")
        self._is_live = self._view not in _DECLARED_ONLY
        self._declared = None if self._is_live else required(declared, f"the view {self._view}")
        self._drawn: tuple[int, frozenset[str]] | None = None
        self._is_drawing = False
        self._finished: deque[Update | Exception] = deque()

    def start(self) -> None:
        """Subscribe to the reports of systems, which have the states of nodes."""
        self._drawn, self._is_drawing = None, False
        self.resources.enter_context(self.ros.reports.used())

    def poll(self) -> Iterator[Update]:
        """Yield what is drawn."""
        while self._finished:
            item = self._finished.popleft()
            if isinstance(item, Exception):
                raise item
            yield item
        ros = self.ros
        self.period_s = _SOON_S if ros.is_new else 1.0
        if self._is_drawing or (self._is_live and ros.waits_for_reports):
            return
        topology = ros.topology()
        states = ros.states() if self._is_live else {}
        #: Nodes with a state have one more line.
        wanted = (topology.revision if self._is_live else 0, frozenset(states))
        if wanted == self._drawn:
            return
        self._drawn = wanted
        self._is_drawing = True
        ros.work(lambda: self._draw(topology, states))

    def _draw(self, topology: Topology, states: Mapping[str, str | None]) -> None:
        from composer.graph.layout import Size

        key = (self._drawn, self._view, self._is_live)
        try:
            diagram = self.ros.diagrams.of(key, lambda: self._laid_out(topology, states))
            self._finished.append(Update(to_json(diagram.on(Size(*self._page)))))
        except Exception as error:  # reported by the next poll
            self._finished.append(error)
        finally:
            self._is_drawing = False
            self.poll_soon()

    def _laid_out(self, topology: Topology, states: Mapping[str, str | None]) -> Diagram:
        from composer.dashboard.observing.diagrams import Diagram, live_scene
        from composer.graph.views import View, scene_of

        if self._declared is not None:
            scene = scene_of([self._declared.system], self._declared.diagnostics)
            return Diagram(scene, View(self._view))
        return Diagram(live_scene(topology.snapshot(states)), View(self._view))


class LiveFeed(Feed):
    """Rates and drops of edges, once a second.

    Rates of a system are in its reports. Other topics are measured.
    """

    follows_reports = True

    def __init__(self, _: Values, __: Declared | None) -> None:
        self._measured: set[str] = set()
        self._rates: dict[str, CountedRate] = {}  # by the keys of edges
        #: What the topics to measure depend on.
        self._known: object = None

    def start(self) -> None:
        """Subscribe to the reports of systems."""
        self._known = None
        self.resources.enter_context(self.ros.reports.used())
        self.resources.callback(self._set_measured, set())

    def poll(self) -> Iterator[Update]:
        """Yield all rates."""
        # Sorted: what other processes of a system report of their nodes is newer, and comes later.
        current = sorted(self.ros.reports.current().items())
        reports = {name: report for name, report in current if report is not None}
        edges: dict[str, Any] = {}
        reported: set[str] = set()
        for report in reports.values():
            for node in report.nodes:
                reported.update(node.sent, node.received)
                edges |= self._edges(node, report.at_s)
        self._rates = {key: rate for key, rate in self._rates.items() if key in edges}
        topics = self._measure(reported)
        yield Update(to_json({"edges": edges, "topics": topics}))

    def _edges(self, node: NodeReport, now_s: float) -> dict[str, Any]:
        """Return the rates of the topics of a node by the keys of their edges."""
        found: dict[str, Any] = {}
        for kind, counts in (("publisher", node.sent), ("subscription", node.received)):
            for topic, count in counts.items():
                key = f"{kind}:{node.node}.{topic}"
                rate = self._rates.setdefault(key, CountedRate())
                rate.read(count, now_s)
                edge: dict[str, Any] = {"rate_hz": rate.current_hz(now_s)}
                if kind == "subscription":
                    edge["dropped_total"] = node.dropped.get(topic, 0)
                found[key] = edge
        return found

    def _measure(self, reported: set[str]) -> dict[str, Any]:
        """Measure the topics that no system reports; return their rates."""
        topology = self.ros.topology()
        known = (topology.revision, reported)
        if known != self._known:
            self._known = known
            topics = _unreported(topology, reported)
            self._set_measured(set(islice(topics, _MAX_MEASURED)))
        if not self._measured:
            return {}
        meters = self.ros.meters
        meters.poll()
        found = {topic: meters.figures(topic) for topic in sorted(self._measured)}
        return {
            topic: {"rate_hz": figures.rate_hz, "lost": figures.lost}
            for topic, figures in found.items()
            if figures is not None
        }

    def _set_measured(self, topics: set[str]) -> None:
        self.ros.meters.acquire(topics - self._measured)
        self.ros.meters.release(self._measured - topics)
        self._measured = topics


def _unreported(topology: Topology, reported: set[str]) -> Iterator[str]:
    """Yield the topics that no system reports, and that are not for tools."""
    for topic, ends in topology.of_topics.items():
        # Managers report only while others listen.
        if topic not in reported and not all(
            end.is_for_tools or node in topology.managers for node, end in ends
        ):
            yield topic
