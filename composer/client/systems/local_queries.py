"""What running systems on this computer know about themselves, without joining the ROS graph.

Each function ``local_...`` returns None if no system on this computer is certain: the command has
to join the graph then, which also produces the errors. Reports that arrive by a topic are completed
here as well.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, TypeVar

from composer.base.characters import visible
from composer.base.fast_dataclass import dataclass
from composer.model.names import is_hidden, is_selected
from composer.plan.drift import ObservedEndpoint
from composer.runtime.metrics.figures import merged_chains
from composer.runtime.process.instance_lock import local_systems
from composer.runtime.process.query_socket import ask
from composer.runtime.protocol.codec import decode
from composer.runtime.protocol.reports import SystemReport, split_signature
from composer.runtime.protocol.requests import (
    IS_ACTIVE,
    NAME,
    DetailsAnswer,
    DetailsQuery,
    EndpointsAnswer,
    EndpointsQuery,
    GraphAnswer,
    GraphQuery,
    GraphView,
    NameAndTypes,
    NodesAnswer,
    NodesQuery,
    ParameterDescription,
    ParametersAnswer,
    ParametersQuery,
    StatusQuery,
    visible_names,
)

#: None stands for a system that did not respond.
AnyReport = TypeVar("AnyReport", SystemReport, SystemReport | None)
#: Longer than a manager waits for its view to become complete.
RESPONSE_S = 0.6
#: The endpoints of the largest systems: discovering the graph takes longer.
ENDPOINTS_S = 1.0
_STATE_SERVICE, _STATE_TYPE = "/get_state", "lifecycle_msgs/srv/GetState"
_LIST_SERVICE, _LIST_TYPE = "/list_parameters", "rcl_interfaces/srv/ListParameters"
_MANAGER_SERVICE, _MANAGER_TYPE = f"/{NAME}/{IS_ACTIVE}", "std_srvs/srv/Trigger"


def parse_state(name: str, text: str) -> SystemReport:
    """Return the report of the system ``name`` in a message, which any node may have published.

    Its texts are without control characters. Raises ProtocolError.
    """
    return of_system(name, decode(split_signature(text)[1], SystemReport, clean=visible))


def nodes_with(services: Iterable[NameAndTypes], suffix: str, type_name: str) -> set[str]:
    """Return the nodes that have a service of that name and type."""
    return {
        name.removesuffix(suffix)
        for name, types in services
        if name.endswith(suffix) and type_name in types
    }


def systems_with(services: Iterable[NameAndTypes]) -> set[str]:
    """Return the systems whose managers have these services.

    The name is the namespace of the manager: ``/pipeline``, ``/robot1/pipeline``.
    """
    return nodes_with(services, _MANAGER_SERVICE, _MANAGER_TYPE) - {""}


def of_system(name: str, report: SystemReport) -> SystemReport:
    """Return a report with the full name of the system, and the host of each node."""
    nodes = (node if node.host else replace(node, host=report.host) for node in report.nodes)
    return replace(report, name=name, nodes=tuple(nodes))


def with_processes(report: SystemReport, others: Mapping[str, SystemReport]) -> SystemReport:
    """Return a report with the callbacks and chains of other processes, by their names."""
    of_others = (callback for other in others.values() for callback in other.callbacks)
    chains = (chain for other in others.values() for chain in other.chains)
    return replace(
        report,
        callbacks=(*report.callbacks, *of_others),
        chains=merged_chains(report.chains, chains),
        processes_at_s={name: other.callbacks_at_s for name, other in others.items()},
    )


def of_whole_systems(reports: Mapping[str, AnyReport]) -> dict[str, AnyReport]:
    """Return reports by their names, without processes whose nodes another report has."""
    answered = [report for report in reports.values() if report is not None]
    others = {name for report in answered for name in report.processes.values()}
    return {name: report for name, report in reports.items() if name not in others}


def with_callbacks_of_processes(reports: Mapping[str, SystemReport]) -> dict[str, SystemReport]:
    """Return reports by their names, each with the callbacks of other processes of its system."""
    found = {}
    for name, report in reports.items():
        known = {
            process: reports[other]
            for process, other in report.processes.items()
            if other in reports
        }
        found[name] = with_processes(report, known)
    return found


@dataclass(frozen=True, slots=True)
class LocalParameters:
    """The parameters of a node, with the methods of a ParameterClient that read."""

    node: str
    described: Mapping[str, tuple[ParameterDescription, Any]]

    def names(self) -> tuple[str, ...]:
        """Return the names of all parameters, sorted."""
        return tuple(sorted(self.described))

    def values(self, names: Iterable[str]) -> dict[str, Any]:
        """Return the values of parameters, None if not set."""
        return {name: self.described[name][1] for name in names}

    def describe(self, names: Iterable[str]) -> tuple[ParameterDescription, ...]:
        """Return the descriptions of parameters."""
        return tuple(self.described[name][0] for name in names)


def local_names(
    kind: str, timeout_s: float, *, hidden: bool = False
) -> tuple[NameAndTypes, ...] | None:
    """Return the names that :meth:`composer.client.graph_names.GraphNames.names` would return."""
    view = local_view(timeout_s)
    if view is None:
        return None
    return view[kind] if hidden else visible_names(view[kind])


def local_view(timeout_s: float) -> GraphView | None:
    """Return the whole graph."""
    answer: GraphAnswer | None = _ask_any(GraphQuery(), timeout_s)
    return None if answer is None else answer.names


def local_endpoints() -> tuple[Mapping[str, tuple[ObservedEndpoint, ...]], list[str]] | None:
    """Return the endpoints by node, and the names of all nodes.

    A name that two nodes share is listed twice.
    """
    answer: EndpointsAnswer | None = _ask_any(EndpointsQuery(), ENDPOINTS_S, ENDPOINTS_S)
    return None if answer is None else (answer.endpoints, list(answer.nodes))


def local_details(kind: str, name: str, timeout_s: float) -> dict[str, Any] | None:
    """Return a node, topic or action that :meth:`GraphNames.details` would return."""
    full_name = name if name.startswith("/") else f"/{name}"
    found = _find(name, timeout_s) if kind == "node" else full_name
    if found is None:
        return None
    answer: DetailsAnswer | None = _ask_any(DetailsQuery(kind, found), timeout_s)
    return None if answer is None else dict(answer.details)


def local_parameters(name: str, timeout_s: float) -> LocalParameters | None:
    """Return the parameters of a node of a system on this computer."""
    full_name = _find(name, timeout_s)
    if full_name is None:
        return None
    return _ask_parameters((full_name,), timeout_s).get(full_name)


def all_local_parameters(timeout_s: float, *, hidden: bool) -> list[LocalParameters] | None:
    """Return the parameters of all nodes in the graph, if systems on this computer have them all.

    Nodes that are hidden are left out unless ``hidden``.
    """
    view = local_view(timeout_s)
    if view is None:
        return None
    known = _ask_parameters(None, timeout_s)
    serving = nodes_with(view["service"], _LIST_SERVICE, _LIST_TYPE)
    if not serving <= known.keys():
        return None
    return [known[node] for node in sorted(known) if hidden or not is_hidden(node)]


def local_report(name: str, timeout_s: float, *, callbacks: bool = False) -> SystemReport | None:
    """Return the report of a running system, by its full name or the last part."""
    systems = [system for system in local_systems() if is_selected(system, name)]
    if len(systems) != 1:
        return None
    report = _ask_report(systems[0], timeout_s, callbacks=callbacks)
    if report is None or not callbacks:
        return report
    others = {
        process: _ask_report(system, timeout_s, callbacks=True)
        for process, system in report.processes.items()
    }
    found = {process: other for process, other in others.items() if other is not None}
    return with_processes(report, found) if len(found) == len(others) else None


def local_reports(timeout_s: float, *, callbacks: bool = False) -> dict[str, SystemReport] | None:
    """Return the reports of all systems, if no others and no other lifecycle nodes run."""
    view = local_view(timeout_s)
    if view is None:
        return None
    reports = {
        system: _ask_report(system, timeout_s, callbacks=callbacks)
        for system in sorted(local_systems())
    }
    found = {system: report for system, report in reports.items() if report is not None}
    systems = systems_with(view["service"])
    nodes = {node.node for report in found.values() for node in report.nodes}
    lifecycle_nodes = nodes_with(view["service"], _STATE_SERVICE, _STATE_TYPE)
    complete = len(found) == len(reports) and systems <= found.keys() and lifecycle_nodes <= nodes
    return with_callbacks_of_processes(found) if complete else None


def local_states(timeout_s: float) -> dict[str, str] | None:
    """Return the state of each lifecycle node, if systems on this computer have them all."""
    reports = local_reports(timeout_s)
    if reports is None:
        return None
    states = {node.node: node.state for report in reports.values() for node in report.nodes}
    return dict(sorted(states.items()))


def local_state(name: str, timeout_s: float) -> str | None:
    """Return the state of a node of a system on this computer."""
    full_name = _find(name, timeout_s)
    if full_name is None:
        return None
    reports = (_ask_report(system, timeout_s) for system in local_systems())
    nodes = (node for report in reports if report is not None for node in report.nodes)
    return next((node.state for node in nodes if node.node == full_name), None)


def _ask_any(query: Any, timeout_s: float, response_s: float = RESPONSE_S) -> Any:
    """Return the answer of the first system that is certain; None if there is none."""
    limit_s = min(response_s, timeout_s)
    answers = (ask(system, query, limit_s) for system in local_systems())
    return next((answer for answer in answers if answer is not None), None)


def _ask_report(system: str, timeout_s: float, *, callbacks: bool = False) -> SystemReport | None:
    report: SystemReport | None = ask(system, StatusQuery(callbacks), min(RESPONSE_S, timeout_s))
    return None if report is None else of_system(system, report)


def _ask_parameters(nodes: tuple[str, ...] | None, timeout_s: float) -> dict[str, LocalParameters]:
    known: dict[str, LocalParameters] = {}
    for system in local_systems():
        answer: ParametersAnswer | None = ask(
            system, ParametersQuery(nodes), min(RESPONSE_S, timeout_s)
        )
        for node, parameters in ({} if answer is None else answer.nodes).items():
            described = {item.name: (item, value) for item, value in parameters}
            known[node] = LocalParameters(node, described)
    return known


def _find(name: str, timeout_s: float) -> str | None:
    """Return the full name of the only node that ``name`` refers to."""
    answer: NodesAnswer | None = _ask_any(NodesQuery(), timeout_s)
    nodes = () if answer is None else answer.nodes
    matches = [node for node in nodes if is_selected(node, name)]
    return matches[0] if len(matches) == 1 else None
