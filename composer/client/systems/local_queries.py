"""What running systems on this computer know about themselves, without joining the ROS graph.

Each function returns None if no system on this computer is certain: the command has to join the
graph then, which also produces the errors.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import wraps
from typing import Any, ParamSpec, TypeVar

from composer.base.fast_dataclass import dataclass
from composer.client.systems.local_graph import RESPONSE_S, local_view
from composer.client.systems.system_reports import (
    InvalidReportError,
    SystemReport,
    system_report,
    with_callbacks_of_processes,
    with_processes,
)
from composer.model.names import is_hidden
from composer.runtime.metrics.figures import CallbackFigures, ChainFigures
from composer.runtime.process.instance_lock import local_systems
from composer.runtime.process.query_socket import (
    ACTION,
    NODE,
    NODES,
    PARAMETERS,
    STATUS,
    TOPIC,
    GraphView,
    ask,
    visible,
)
from composer.runtime.ros.parameter_description import ParameterDescription

P = ParamSpec("P")
T = TypeVar("T")

_STATE_SERVICE, _STATE_TYPE = "/get_state", "lifecycle_msgs/srv/GetState"
_LIST_SERVICE, _LIST_TYPE = "/list_parameters", "rcl_interfaces/srv/ListParameters"
_MANAGER_SERVICE = "/manager/is_active"


def _none_for_other_versions(function: Callable[P, T | None]) -> Callable[P, T | None]:
    """Return None if an answer has another shape: the system may be of another version."""

    @wraps(function)
    def call(*arguments: P.args, **options: P.kwargs) -> T | None:
        with suppress(ValueError, KeyError, TypeError, AttributeError):
            return function(*arguments, **options)
        return None

    return call


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


@_none_for_other_versions
def local_node(name: str, timeout_s: float, *, hidden: bool) -> dict[str, Any] | None:
    """Return the endpoints of a node, by the names of the fields of NodeInfo."""
    full_name = _find(name, timeout_s)
    if full_name is None:
        return None
    found: dict[str, Any] | None = _ask_any(NODE, full_name, timeout_s)
    if found is None or hidden:
        return found
    return {
        key: visible(map(tuple, value)) if isinstance(value, list) else value
        for key, value in found.items()
    }


@_none_for_other_versions
def local_topic(name: str, timeout_s: float) -> dict[str, Any] | None:
    """Return the endpoints of a topic, as :meth:`TopicInfo.plain` does."""
    found = _ask_any(TOPIC, name, timeout_s)
    if found is None:
        return None
    endpoints = {
        key: [
            {fact: end[fact] for fact in ("node", "type", "type_hash", "gid")}
            | {"qos": dict(end["qos"])}
            for end in found[key]
        ]
        for key in ("publishers", "subscriptions")
    }
    return {"name": found["name"], "types": list(map(str, found["types"]))} | endpoints


@_none_for_other_versions
def local_action(name: str, timeout_s: float) -> dict[str, Any] | None:
    """Return the nodes with servers and clients of an action, by the names of ActionInfo."""
    found = _ask_any(ACTION, name, timeout_s)
    if found is None:
        return None
    lists = {key: list(map(str, found[key])) for key in ("types", "servers", "clients")}
    return {"name": found["name"]} | lists


@_none_for_other_versions
def local_parameters(name: str, timeout_s: float) -> LocalParameters | None:
    """Return the parameters of a node of a system on this computer."""
    full_name = _find(name, timeout_s)
    if full_name is None:
        return None
    return _ask_parameters([full_name], timeout_s).get(full_name)


@_none_for_other_versions
def all_local_parameters(timeout_s: float, *, hidden: bool) -> list[LocalParameters] | None:
    """Return the parameters of all nodes in the graph, if systems on this computer have them all.

    Nodes that are hidden are left out unless ``hidden``.
    """
    view = local_view(timeout_s)
    if view is None:
        return None
    known = _ask_parameters(None, timeout_s)
    serving = _servers(view, _LIST_SERVICE, _LIST_TYPE)
    if not serving <= known.keys():
        return None
    return [known[node] for node in sorted(known) if hidden or not is_hidden(node)]


@_none_for_other_versions
def local_report(name: str, timeout_s: float, *, callbacks: bool = False) -> SystemReport | None:
    """Return the report of a running system, by its full name or the last part."""
    systems = [system for system in local_systems() if f"/{system}".endswith(f"/{name}")]
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


@_none_for_other_versions
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
    managers = {
        name.removesuffix(_MANAGER_SERVICE)
        for name, _ in view["service"]
        if name.endswith(_MANAGER_SERVICE)
    }
    nodes = {node.node for report in found.values() for node in report.nodes}
    lifecycle_nodes = _servers(view, _STATE_SERVICE, _STATE_TYPE)
    complete = len(found) == len(reports) and managers <= found.keys() and lifecycle_nodes <= nodes
    return with_callbacks_of_processes(found) if complete else None


@_none_for_other_versions
def local_states(timeout_s: float) -> dict[str, str] | None:
    """Return the state of each lifecycle node, if systems on this computer have them all."""
    reports = local_reports(timeout_s)
    if reports is None:
        return None
    states = {node.node: node.state for report in reports.values() for node in report.nodes}
    return dict(sorted(states.items()))


@_none_for_other_versions
def local_state(name: str, timeout_s: float) -> str | None:
    """Return the state of a node of a system on this computer."""
    full_name = _find(name, timeout_s)
    if full_name is None:
        return None
    reports = (_ask_report(system, timeout_s) for system in local_systems())
    nodes = (node for report in reports if report is not None for node in report.nodes)
    return next((node.state for node in nodes if node.node == full_name), None)


def _ask_any(query: str, name: str, timeout_s: float) -> Any:
    """Return what the first system that is certain knows of a name; None if there is none."""
    absolute = name if name.startswith("/") else f"/{name}"
    limit_s = min(RESPONSE_S, timeout_s)
    answers = (ask(system, query, absolute, limit_s) for system in local_systems())
    return next((answer for answer in answers if answer), None)


def _ask_report(system: str, timeout_s: float, *, callbacks: bool = False) -> SystemReport | None:
    answer = ask(system, STATUS, callbacks, min(RESPONSE_S, timeout_s))
    if answer is None:
        return None
    try:
        report = system_report(system, answer["status"])
    except InvalidReportError:
        return None
    return replace(
        report,
        callbacks=tuple(CallbackFigures(**figures) for figures in answer["callbacks"]),
        chains=tuple(ChainFigures(**figures) for figures in answer["chains"]),
    )


def _ask_parameters(nodes: list[str] | None, timeout_s: float) -> dict[str, LocalParameters]:
    known: dict[str, LocalParameters] = {}
    for system in local_systems():
        answer = ask(system, PARAMETERS, nodes, min(RESPONSE_S, timeout_s)) or {}
        for node, parameters in answer.items():
            known[node] = LocalParameters(
                node,
                {
                    facts["name"]: (ParameterDescription(**facts), value)
                    for facts, value in parameters
                },
            )
    return known


def _find(name: str, timeout_s: float) -> str | None:
    """Return the full name of the only node that ``name`` refers to."""
    limit_s = min(RESPONSE_S, timeout_s)
    answers = (ask(system, NODES, None, limit_s) for system in local_systems())
    nodes: list[str] = next((answer for answer in answers if answer), [])
    if name in nodes:
        return name if nodes.count(name) == 1 else None
    matches = [] if name.startswith("/") else [node for node in nodes if node.endswith(f"/{name}")]
    return matches[0] if len(matches) == 1 else None


def _servers(view: GraphView, suffix: str, type_name: str) -> set[str]:
    """Return the nodes with a service of that name and type."""
    return {
        name.removesuffix(suffix)
        for name, types in view["service"]
        if name.endswith(suffix) and type_name in types
    }
