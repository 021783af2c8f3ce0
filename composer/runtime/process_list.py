"""What runs: systems as their managers tell, and lifecycle nodes that no composer runs."""

from __future__ import annotations

from dataclasses import dataclass, field

from composer.runtime.claim import claims
from composer.runtime.control import Control
from composer.runtime.session import Deadline, Session
from composer.runtime.systems import SystemReport, Systems

#: Managers tell at once and again each second; who has not answered by then is said to be silent.
_PATIENCE_S = 2.0
_STILL_WITHIN_S = 1.0


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
    here = claims()
    reports = systems.reports(sorted(here), _patience(deadline)) if here else {}
    # Where a composer runs, there is no need to wait for the first of all nodes to be discovered.
    rest = Deadline(min(_STILL_WITHIN_S, deadline.left_s)) if here else deadline
    names, nodes = session.wait_until_still(lambda: (systems.look(), control.known()), rest)
    found = [name for name in names if name not in reports]
    reports |= systems.reports(found, _patience(deadline)) if found else {}
    managed = {node.node for report in reports.values() if report for node in report.nodes}
    others = [node for node in nodes if node not in managed]
    patient = Control(session, _patience(deadline))
    return ProcessList(dict(sorted(reports.items())), patient.states(others) if others else {})


def list_one(session: Session, deadline: Deadline, name: str, *, callbacks: bool) -> ProcessList:
    """Return one system. Raises NotThere and NoAnswer."""
    systems = Systems(session, deadline, callbacks=callbacks)
    found = systems.find(name)
    return ProcessList({found: systems.report(found)})


def _patience(deadline: Deadline) -> Deadline:
    return Deadline(min(_PATIENCE_S, deadline.left_s))
