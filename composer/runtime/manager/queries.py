"""What the manager of a system answers to queries of commands on this computer.

See :mod:`composer.runtime.process.query_socket`, on whose thread the methods are called.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from typing import Any

from composer.runtime.executors.loop import Loop
from composer.runtime.manager.graph_view import GraphObserver
from composer.runtime.node.parameter_services import ParameterServices, count_items
from composer.runtime.process.query_socket import Answer
from composer.runtime.protocol.reports import SystemReport, TimingReport
from composer.runtime.protocol.requests import (
    ActionQuery,
    EndpointsQuery,
    GraphQuery,
    NodeQuery,
    NodesQuery,
    ParameterDescription,
    ParametersAnswer,
    ParametersQuery,
    StatusQuery,
    TopicQuery,
)
from composer.runtime.ros.parameter_values import plain_value

#: Commands wait a little longer. A node that hangs does not answer.
_PARAMETERS_WITHIN_S = 0.4
#: Parameters, array items and characters in one answer: writing it as JSON holds the GIL. Larger
#: values are left to the parameter services.
_MAX_ITEMS = 20_000


class ManagerQueries:
    """Answers queries, or returns None if the answer is not certain."""

    def __init__(
        self,
        loop: Loop,
        graph: GraphObserver,
        parameters: Callable[[], Mapping[str, tuple[Loop, ParameterServices]]],
        report: Callable[[], SystemReport],
        timings: Callable[[], TimingReport],
    ) -> None:
        """``parameters()`` returns the loop and the parameters of each node, by full name."""
        self._loop = loop
        self._graph = graph
        self._parameters = parameters
        self._report = report
        self._timings = timings

    def answers(self) -> Mapping[type[Any], Answer]:
        """Return the answers by the types of queries."""
        return {
            GraphQuery: lambda _: self._graph.view(),
            NodesQuery: lambda _: self._graph.nodes(),
            NodeQuery: lambda query: self._graph.node(query.name),
            TopicQuery: lambda query: self._graph.topic(query.name),
            ActionQuery: lambda query: self._graph.action(query.name),
            EndpointsQuery: lambda _: self._graph.endpoints(),
            StatusQuery: self._status,
            ParametersQuery: self._node_parameters,
        }

    def _status(self, query: StatusQuery) -> SystemReport:
        report = self._report()
        if not query.callbacks:
            return report
        timed = self._timings()
        return replace(
            report, callbacks=timed.callbacks, chains=timed.chains, callbacks_at_s=timed.at_s
        )

    def _node_parameters(self, query: ParametersQuery) -> ParametersAnswer | None:
        """Return descriptions and values of the parameters of the system's nodes and manager.

        Other nodes are left out, and so are those of other processes, which have parameter services
        of their own.
        """
        done = threading.Event()
        future = self._loop.run_task(self._collect(query.nodes))
        future.add_done_callback(lambda _: done.set())
        if not self._loop.clock.wait(done, _PARAMETERS_WITHIN_S):
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
