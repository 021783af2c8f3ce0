"""Running systems as their managers report them, and other lifecycle nodes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeAlias

from lifecycle_msgs.srv import GetState

from composer.client.graph_names import not_found_error, only_match
from composer.client.session import Deadline, NoResponseError, Session
from composer.client.systems.local_queries import with_callbacks_of_processes
from composer.client.systems.managers import DISCOVERY_S, REPORT_WITHIN_S, Systems, without_members
from composer.client.systems.node_services import NodeServices
from composer.model.names import is_pattern, is_selected
from composer.plan.drift import ObservedProcess
from composer.runtime.process.instance_lock import local_systems
from composer.runtime.protocol.codec import OtherVersionError
from composer.runtime.protocol.reports import SystemReport
from composer.runtime.protocol.requests import NAME

#: How long to wait for the responses of other nodes after discovery.
_RESPONSE_S = 2.0


#: The reports of systems by the namespaces of their managers. An error stands for a system of
#: another version, None for a system that did not respond.
Reports: TypeAlias = Mapping[str, SystemReport | OtherVersionError | None]
#: The reports, and the states of other lifecycle nodes: None for a node that did not respond.
Processes: TypeAlias = tuple[Reports, Mapping[str, str | None]]


def list_processes(session: Session, deadline: Deadline, *, callbacks: bool) -> Processes:
    """Return all systems and lifecycle nodes, once discovery is complete."""
    systems = Systems(session, deadline, callbacks=callbacks)
    services = NodeServices(session)
    discovery = deadline.at_most(DISCOVERY_S)
    local = sorted(local_systems())
    systems.subscribe(local)
    names, nodes = session.wait_until_settled(
        lambda: (systems.discover(), services.nodes(GetState, deadline)), deadline
    )
    reports = systems.reports({*local, *names}, discovery)
    managed = {node.node for report in reports.values() if report for node in report.nodes}
    unread = {
        name: systems.other_version(name) for name, report in reports.items() if report is None
    }
    states = services.states(sorted(nodes - managed), deadline.at_most(_RESPONSE_S))
    whole = with_callbacks_of_processes({name: item for name, item in reports.items() if item})
    return {**reports, **whole, **unread}, states


def list_one(session: Session, deadline: Deadline, name: str, *, callbacks: bool) -> Processes:
    """Return one system. Raises NotFoundError, NoResponseError."""
    systems = Systems(session, deadline, callbacks=callbacks)
    found = systems.find(name)
    discovery = deadline.at_most(DISCOVERY_S)
    report = systems.reports([found], discovery)[found]
    if report is None:
        error = systems.other_version(found)
        if error is not None:
            return {found: error}, {}
        report = systems.report(found)
    return {found: systems.whole(report) if callbacks else report}, {}


def observed_processes(reports: Reports) -> tuple[ObservedProcess, ...]:
    """Return the processes of systems, with their nodes and managers, by the reports of all."""
    known = {name: report for name, report in reports.items() if isinstance(report, SystemReport)}
    nodes: dict[str, dict[str, None]] = {}
    for report in known.values():
        for node in report.nodes:
            nodes.setdefault(_process_of(report, node.process, known), {})[node.node] = None
    processes = []
    for name, found in sorted(nodes.items()):
        host, pid = (known[name].host, known[name].pid) if name in known else ("", "")
        processes.append(ObservedProcess(name, host, pid, (*found, f"{name}/{NAME}")))
    return tuple(processes)


def _process_of(report: SystemReport, process: str, known: Mapping[str, SystemReport]) -> str:
    """Return the namespace of the manager of a process that a report names."""
    name = f"{report.name}/{process}"
    is_own = not process or (name not in known and report.name.endswith(f"/{process}"))
    return report.name if is_own else name


def find_managed_nodes(
    session: Session, deadline: Deadline, systems: Systems, targets: Iterable[str]
) -> dict[str, tuple[str, ...]]:
    """Return the nodes that match the targets, by the systems that manage them.

    A target is a full name, the last part of a name, or a pattern. Raises NotFoundError;
    NoResponseError if a target is not found and a system does not respond.
    """
    names: Iterable[str] = {
        *session.wait_until_settled(systems.discover, deadline),
        *local_systems(),
    }
    names = without_members(names)  # the others move their nodes for one of these
    reports = systems.reports(names, deadline.at_most(REPORT_WITHIN_S))
    system_of = {
        node.node: name for name, report in reports.items() if report for node in report.nodes
    }
    silent = [name for name, report in reports.items() if report is None]
    found: dict[str, dict[str, None]] = {}
    for target in targets:
        for node in _matches(target, system_of, silent):
            found.setdefault(system_of[node], {})[node] = None
    return {system: tuple(nodes) for system, nodes in found.items()}


def _matches(target: str, known: Iterable[str], silent: list[str]) -> list[str]:
    found = [node for node in known if is_selected(node, target)]
    if not found and silent:
        raise NoResponseError(
            f"{silent[0]} does not respond, so its nodes are not known",
            "its process may be busy or stopped",
        )
    if not found:
        raise not_found_error("node of a running system", target, known)
    return found if is_pattern(target) else [only_match("node", target, found)]
