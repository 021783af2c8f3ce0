"""What the manager of a system answers to queries of commands on this computer.

See :mod:`composer.runtime.process.query_socket`, on whose thread the methods are called.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from rcl_interfaces.msg import ParameterValue

from composer.runtime.executors.loop import Loop
from composer.runtime.manager.graph_view import GraphObserver
from composer.runtime.manager.proxy_services import ProxyParameterStore
from composer.runtime.node.parameter_services import count_items, in_slices
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
    full_parameter_name,
)
from composer.runtime.ros.parameter_values import description, plain_value

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
        parameters: ProxyParameterStore,
        report: Callable[[], SystemReport],
        timings: Callable[[], TimingReport],
    ) -> None:
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
        names = [
            name for name in self._parameters.nodes() if query.nodes is None or name in query.nodes
        ]
        done = threading.Event()
        future = self._loop.run_task(self._collect(names))
        future.add_done_callback(lambda _: done.set())
        if not self._loop.clock.wait(done, _PARAMETERS_WITHIN_S):
            future.cancel()
            return None
        return future.result()

    async def _collect(self, nodes: list[str]) -> ParametersAnswer | None:
        """Return the parameters of the nodes, None if they are too many or too large."""
        left = _MAX_ITEMS
        found: dict[str, tuple[tuple[ParameterDescription, Any], ...]] = {}
        for node in nodes:
            of_node = []
            names = await self._parameters.names_of(node)
            async for described, value in in_slices(
                self._loop.clock, names, partial(self._parameter, node)
            ):
                left -= 1 + count_items(value)
                if left < 0:
                    return None
                of_node.append((described, plain_value(value)))
            found[node] = tuple(of_node)
        return ParametersAnswer(found)

    async def _parameter(self, node: str, name: str) -> tuple[ParameterDescription, ParameterValue]:
        store = self._parameters
        full_name = name if node == store.manager else full_parameter_name(node, name)
        return description(name, await store.descriptor(full_name)), await store.value(full_name)
