"""What runs: systems as their managers tell, and lifecycle nodes that no composer runs."""

from __future__ import annotations

from dataclasses import dataclass, field

from composer.remote.lifecycle import Control
from composer.remote.session import Deadline, Session
from composer.remote.systems import MEETING_S, SystemReport, Systems
from composer.runtime.process.instance_lock import local_systems

#: Who does not answer so soon after being met is said to be silent.
_PATIENCE_S = 2.0


@dataclass(frozen=True, slots=True)
class ProcessList:
    """Systems by the namespaces of their managers, and the states of other lifecycle nodes.

    None stands for who did not answer.
    """

    systems: dict[str, SystemReport | None]
    others: dict[str, str | None] = field(default_factory=dict)


def list_processes(session: Session, deadline: Deadline, *, callbacks: bool) -> ProcessList:
    """Return everything there is, once discovery stands still; with or without callbacks."""
    systems = Systems(session, deadline, callbacks=callbacks)
    control = Control(session, deadline)
    meeting = Deadline(min(MEETING_S, deadline.left_s))
    here = sorted(local_systems())
    systems.listen(here)
    names, nodes = session.wait_until_still(lambda: (systems.look(), control.known()), deadline)
    reports = systems.reports({*here, *names}, meeting)
    managed = {node.node for report in reports.values() if report for node in report.nodes}
    others = [node for node in nodes if node not in managed]
    patient = Control(session, Deadline(min(_PATIENCE_S, deadline.left_s)))
    return ProcessList(reports, patient.states(others) if others else {})


def list_one(session: Session, deadline: Deadline, name: str, *, callbacks: bool) -> ProcessList:
    """Return one system. Raises NotThere and NoAnswer."""
    systems = Systems(session, deadline, callbacks=callbacks)
    found = systems.find(name)
    return ProcessList({found: systems.report(found)})
