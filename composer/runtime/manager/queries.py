"""What the manager of a system answers to queries of commands on this computer.

See :mod:`composer.runtime.process.query_socket`, on whose thread the methods are called.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict
from functools import partial
from typing import Any

from rcl_interfaces.msg import ParameterValue

from composer.runtime.executors.loop import Loop
from composer.runtime.manager.graph_view import GraphObserver
from composer.runtime.manager.proxy_services import ProxyParameterStore
from composer.runtime.metrics.figures import CallbackFigures, ChainFigures
from composer.runtime.node.parameter_services import count_items, in_slices
from composer.runtime.process.query_socket import (
    ACTION,
    ENDPOINTS,
    GRAPH,
    NODE,
    NODES,
    PARAMETERS,
    STATUS,
    TOPIC,
    Answer,
)
from composer.runtime.ros.diagnostic_arrays import Status
from composer.runtime.ros.manager_protocol import full_parameter_name
from composer.runtime.ros.parameter_description import ParameterDescription
from composer.runtime.ros.parameter_values import description, plain_value

#: Commands wait a little longer. A node that hangs does not answer.
_PARAMETERS_WITHIN_S = 0.4
#: Parameters, array items and characters in one answer: writing it as JSON holds the GIL. Larger
#: values are left to the parameter services.
_MAX_ITEMS = 20_000


class ManagerQueries:
    """Answers queries with plain data, or with None if the answer is not certain."""

    def __init__(
        self,
        loop: Loop,
        graph: GraphObserver,
        parameters: ProxyParameterStore,
        status: Callable[[], Iterable[Status]],
        figures: Callable[[], tuple[Iterable[CallbackFigures], Iterable[ChainFigures]]],
    ) -> None:
        """``figures()`` returns the timings of callbacks and chains."""
        self._loop = loop
        self._graph = graph
        self._parameters = parameters
        self._status = status
        self._figures = figures

    def answers(self) -> Mapping[str, Answer]:
        """Return the queries by name."""
        return {
            GRAPH: lambda _: self._graph.view(),
            NODES: lambda _: self._graph.nodes(),
            NODE: lambda name: self._graph.node(str(name)),
            TOPIC: lambda name: self._graph.topic(str(name)),
            ACTION: lambda name: self._graph.action(str(name)),
            ENDPOINTS: lambda _: self._graph.endpoints(),
            STATUS: lambda callbacks: self._system_status(callbacks=bool(callbacks)),
            PARAMETERS: self._node_parameters,
        }

    def _system_status(self, *, callbacks: bool) -> dict[str, list[Any]]:
        """Return the name, the message and the values of the system and of each node.

        With ``callbacks``, add the timings of callbacks and chains.
        """
        statuses = [[item.name, item.message, item.values] for item in self._status()]
        timed, chains = self._figures() if callbacks else ((), ())
        return {
            "status": statuses,
            "callbacks": list(map(asdict, timed)),
            "chains": list(map(asdict, chains)),
        }

    def _node_parameters(self, requested: Any) -> dict[str, list[Any]] | None:
        """Return descriptions and values of the parameters of the system's nodes and manager.

        ``requested`` are full names of nodes, None for all. Other nodes are left out, and so are
        those of other processes, which have parameter services of their own.
        """
        names = [
            name for name in self._parameters.nodes() if requested is None or name in requested
        ]
        done = threading.Event()
        future = self._loop.run_task(self._collect(names))
        future.add_done_callback(lambda _: done.set())
        if not done.wait(_PARAMETERS_WITHIN_S):
            future.cancel()
            return None
        return future.result()

    async def _collect(self, nodes: list[str]) -> dict[str, list[Any]] | None:
        """Return the parameters of the nodes, None if they are too many or too large."""
        left = _MAX_ITEMS
        found: dict[str, list[Any]] = {}
        for node in nodes:
            found[node] = []
            names = await self._parameters.names_of(node)
            async for described, value in in_slices(names, partial(self._parameter, node)):
                left -= 1 + count_items(value)
                if left < 0:
                    return None
                found[node].append([asdict(described), plain_value(value)])
        return found

    async def _parameter(self, node: str, name: str) -> tuple[ParameterDescription, ParameterValue]:
        store = self._parameters
        full_name = name if node == store.manager else full_parameter_name(node, name)
        return description(name, await store.descriptor(full_name)), await store.value(full_name)
