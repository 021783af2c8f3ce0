"""The manager's view of the ROS graph, and its answers to queries of commands on this computer.

See :mod:`composer.runtime.process.query_socket`, on whose thread the answers are given.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from typing import Any

from composer.runtime.clock import COMPUTER
from composer.runtime.executors.futures import done_event
from composer.runtime.executors.loop import Loop
from composer.runtime.manager.publishing import ReportPublisher
from composer.runtime.middleware.local_resources import count_participants
from composer.runtime.node.parameter_services import ParameterServices, count_items
from composer.runtime.process.query_socket import Answer
from composer.runtime.protocol.reports import SystemReport
from composer.runtime.protocol.requests import (
    KINDS,
    DetailsAnswer,
    DetailsQuery,
    EndpointsAnswer,
    EndpointsQuery,
    GraphAnswer,
    GraphQuery,
    GraphView,
    NodesAnswer,
    NodesQuery,
    ParameterDescription,
    ParametersAnswer,
    ParametersQuery,
    StatusQuery,
)
from composer.runtime.ros.conversions import plain_value
from composer.runtime.ros.endpoints import details, endpoints, node_names
from composer.runtime.ros.graph import SETTLE_S, GraphChanges, RosGraph

#: How long to wait for a process that has just started; commands wait longer than that.
_COMPLETE_WITHIN_S = 0.4
_POLL_S = 0.02
#: Endpoints in one answer: writing it as JSON holds the GIL. Larger graphs have to be discovered.
_MAX_ENDPOINTS = 20_000
#: The bytes of a participant's prefix that Fast DDS derives from the computer.
_HOST = slice(2, 4)
#: Commands wait a little longer. A node that hangs does not answer.
_PARAMETERS_WITHIN_S = 0.4
#: Parameters, array items and characters in one answer: writing it as JSON holds the GIL. Larger
#: values are left to the parameter services.
_MAX_ITEMS = 20_000


class GraphObserver:
    """Looks at the graph for commands.

    DDS does not report when discovery is complete, and shows a killed process for up to 20 s. The
    view counts as complete if it has as many participants on this computer as Linux lists sockets,
    and if they have been known for a while or nothing changes anymore.
    """

    def __init__(self, changes: GraphChanges, own_participant: bytes) -> None:
        """``own_participant`` is the prefix of the ids of the endpoints of the node."""
        self._node = node = changes.node
        self._own_host = own_participant[_HOST]
        self._domain_id = node.context.get_domain_id()
        self._recent: frozenset[bytes] = frozenset()
        self._settled: frozenset[bytes] = frozenset()
        self._changes = changes
        #: The last answer about all endpoints, and the change of the graph before it.
        self._endpoints: EndpointsAnswer | None = None
        self._change = -1
        self._noted_change = -1

    def note_participants(self) -> None:
        """Note which participants are known. Call it every second.

        In a large system, a query takes milliseconds.
        """
        change = self._changes.number()
        self._settled = self._recent
        if change != self._noted_change:
            self._noted_change = change
            self._recent = RosGraph(self._node).participants()

    def view(self) -> GraphAnswer | None:
        """Return the graph, None if it may be incomplete. Any thread may call."""
        end_s = COMPUTER.monotonic() + _COMPLETE_WITHIN_S
        last: GraphView | None = None
        changed_s = 0.0
        while True:
            graph = RosGraph(self._node)
            known = graph.participants()
            view = {kind: graph.names(kind) for kind in KINDS}
            if graph.skipped:
                return None  # the command warns of it
            now_s = COMPUTER.monotonic()
            if view != last:
                last, changed_s = view, now_s
            is_settled = known <= self._settled or now_s >= changed_s + SETTLE_S
            if is_settled and self._are_all_known(graph, known):
                return GraphAnswer(view)
            if now_s > end_s:
                return None
            COMPUTER.sleep(_POLL_S)

    def nodes(self) -> NodesAnswer | None:
        """Return the nodes that can be meant by a name; None if some may be missing.

        Those of a process that was just killed may be among them.
        """
        end_s = COMPUTER.monotonic() + _COMPLETE_WITHIN_S
        while True:
            graph = RosGraph(self._node)
            names = tuple(name for name, _ in graph.names("node"))
            if self._has_all_participants(graph) and graph.are_nodes_known():
                return NodesAnswer(names)
            if COMPUTER.monotonic() > end_s:
                return None
            COMPUTER.sleep(_POLL_S)

    def details(self, kind: str, name: str) -> DetailsAnswer | None:
        """Return a node, topic or action; None if there is no such one, or as for `view`.

        `nodes` has just returned the node that is asked for, so the view may be incomplete.
        """
        types: tuple[str, ...] | None = ()
        if kind != "node":
            view = self.view()
            types = None if view is None else dict(view.names[kind]).get(name)
        if types is None:
            return None
        return DetailsAnswer(details(RosGraph(self._node), kind, name, types))

    def endpoints(self) -> EndpointsAnswer | None:
        """Return the endpoints of all nodes, and the names of all nodes; None as for `nodes`.

        Some of the endpoints of a process that has just started may be missing. The answer takes
        most of a second in a large system on a busy computer, so it is kept until the next change.
        """
        change = self._changes.number()
        is_known = self._endpoints is not None and change == self._change
        if not is_known or not self._has_all_participants(RosGraph(self._node)):
            self._endpoints, self._change = self._new_endpoints(), change
        return self._endpoints

    def _new_endpoints(self) -> EndpointsAnswer | None:
        if self.nodes() is None:
            return None
        graph = RosGraph(self._node)
        found = endpoints(graph)
        if sum(len(ends) for _, ends in found) > _MAX_ENDPOINTS:
            return None
        return EndpointsAnswer(dict(found), tuple(node_names(graph)))

    def _are_all_known(self, graph: RosGraph, known: frozenset[bytes]) -> bool:
        """Say whether every process on this computer is known, and no ended one is."""
        local = self._count_local(known)
        return local == count_participants(self._domain_id) and graph.are_nodes_known()

    def _has_all_participants(self, graph: RosGraph) -> bool:
        """Say whether every process on this computer is known; an ended one may be, too."""
        return self._count_local(graph.participants()) >= count_participants(self._domain_id)

    def _count_local(self, known: frozenset[bytes]) -> int:
        """Return how many of the participants are on this computer."""
        return sum(prefix[_HOST] == self._own_host for prefix in known)


class ManagerQueries:
    """Answers queries, or returns None if the answer is not certain."""

    def __init__(
        self,
        loop: Loop,
        graph: GraphObserver,
        parameters: Callable[[], Mapping[str, tuple[Loop, ParameterServices]]],
        reports: ReportPublisher,
    ) -> None:
        """``parameters()`` returns the loop and the parameters of each node, by full name."""
        self._loop = loop
        self._graph = graph
        self._parameters = parameters
        self._reports = reports

    def answers(self) -> Mapping[type[Any], Answer]:
        """Return the answers by the types of queries."""
        return {
            GraphQuery: lambda _: self._graph.view(),
            NodesQuery: lambda _: self._graph.nodes(),
            DetailsQuery: lambda query: self._graph.details(query.kind, query.name),
            EndpointsQuery: lambda _: self._graph.endpoints(),
            StatusQuery: self._status,
            ParametersQuery: self._node_parameters,
        }

    def _status(self, query: StatusQuery) -> SystemReport:
        report = self._reports.report()
        if not query.callbacks:
            return report
        timed = self._reports.timings()
        return replace(
            report, callbacks=timed.callbacks, chains=timed.chains, callbacks_at_s=timed.at_s
        )

    def _node_parameters(self, query: ParametersQuery) -> ParametersAnswer | None:
        """Return descriptions and values of the parameters of the system's nodes and manager.

        Other nodes are left out, also nodes of other processes, which have parameter services
        of their own.
        """
        future = self._loop.run_task(self._collect(query.nodes))
        if not self._loop.clock.wait(done_event(future), _PARAMETERS_WITHIN_S):
            future.cancel()
            return None
        return future.result()

    async def _collect(self, nodes: Collection[str] | None) -> ParametersAnswer | None:
        """Return the parameters of the nodes, None if they are too many or too large."""
        left = _MAX_ITEMS
        found: dict[str, tuple[tuple[ParameterDescription, Any], ...]] = {}
        for name, (loop, services) in self._parameters().items():
            if nodes is not None and name not in nodes:
                continue
            described = await loop.run_task(services.described())
            left -= sum(1 + count_items(value) for _, value in described)
            if left < 0:
                return None
            found[name] = tuple((item, plain_value(value)) for item, value in described)
        return ParametersAnswer(found)
