"""Running systems as their managers report them, and other lifecycle nodes."""

from __future__ import annotations

from dataclasses import field

from composer.fast_dataclass import dataclass
from composer.remote.lifecycle import LifecycleClient
from composer.remote.session import Deadline, Session
from composer.remote.system_reports import SystemReport
from composer.remote.systems import DISCOVERY_S, Systems
from composer.runtime.process.instance_lock import local_systems

#: How long to wait for the responses of other nodes after discovery.
_RESPONSE_S = 2.0


@dataclass(frozen=True, slots=True)
class ProcessList:
    """Systems by the namespaces of their managers, and the states of other lifecycle nodes.

    None stands for a system or node that did not respond.
    """

    systems: dict[str, SystemReport | None]
    others: dict[str, str | None] = field(default_factory=dict)


def list_processes(session: Session, deadline: Deadline, *, callbacks: bool) -> ProcessList:
    """Return all systems and lifecycle nodes, once discovery is complete."""
    systems = Systems(session, deadline, callbacks=callbacks)
    client = LifecycleClient(session, deadline)
    discovery = Deadline(min(DISCOVERY_S, deadline.left_s))
    local = sorted(local_systems())
    systems.subscribe(local)
    names, nodes = session.wait_until_settled(
        lambda: (systems.discover(), client.known()), deadline
    )
    reports = systems.reports({*local, *names}, discovery)
    managed = {node.node for report in reports.values() if report for node in report.nodes}
    others = [node for node in nodes if node not in managed]
    limited = LifecycleClient(session, Deadline(min(_RESPONSE_S, deadline.left_s)))
    return ProcessList(reports, limited.states(others) if others else {})


def list_one(session: Session, deadline: Deadline, name: str, *, callbacks: bool) -> ProcessList:
    """Return one system. Raises NotFoundError, NoResponseError."""
    systems = Systems(session, deadline, callbacks=callbacks)
    found = systems.find(name)
    return ProcessList({found: systems.report(found)})
