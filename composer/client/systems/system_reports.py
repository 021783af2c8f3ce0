"""What manager nodes report about their systems, read from diagnostic_msgs/msg/DiagnosticArray.

The messages may be those of another version, or of any node that publishes on the same topic.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field, replace
from typing import TypeAlias, TypeVar

from composer.base.characters import visible
from composer.base.fast_dataclass import dataclass
from composer.runtime.metrics.figures import CallbackFigures, ChainFigures, merged_chains
from composer.runtime.ros.diagnostic_arrays import finite, optional, read_array, whole


class InvalidReportError(Exception):
    """A message is not a report of this version of the manager node."""


@dataclass(frozen=True, slots=True)
class NodeReport:
    """A node as its manager reports it. ``since_s`` is in seconds since 1970.

    ``depends_on`` are the states that the nodes it depends on must have, by their full names.
    ``held_down`` is why it is kept down; ``condition`` says in words what becomes of it, or what it
    waits for. Rates and ``busy`` are None if they are not known, as of an executable. ``sent``,
    ``received`` and ``dropped`` count messages by topic; the last is without zeros. ``process`` is
    the process of the system that it runs in, empty for the one that reports. ``host`` and ``pid``
    are those of the operating system's process; ``pid`` is empty while none runs or it is not
    known.
    """

    node: str
    state: str
    desired: str
    since_s: float
    restarts: int
    errors: int
    last_error: str
    held_down: str
    condition: str
    sent_hz: float | None
    received_hz: float | None
    busy: float | None
    slowest: str
    overruns: int
    queue_drops: int
    qos_events: Mapping[str, int]
    depends_on: Mapping[str, str]
    sent: Mapping[str, int]
    received: Mapping[str, int]
    dropped: Mapping[str, int]
    process: str = ""
    host: str = ""
    pid: str = ""


@dataclass(frozen=True, slots=True)
class SystemReport:
    """A system as its manager reports it. ``name`` is the namespace of the manager.

    ``is_ready`` is whether all nodes are in the states in which it keeps them, and those that a
    start activates are active. ``at_s`` is the time of a report that was published, in seconds
    since 1970 or simulated time.
    ``callbacks`` and ``chains`` are included on request, with their time ``callbacks_at_s``. Those
    of other processes of the system may be added, with their times ``processes_at_s``.
    """

    name: str
    activity: str
    message: str
    host: str
    pid: str
    nodes: tuple[NodeReport, ...]
    is_ready: bool = False
    at_s: float = 0.0
    callbacks: tuple[CallbackFigures, ...] = ()
    chains: tuple[ChainFigures, ...] = ()
    callbacks_at_s: float = 0.0
    processes_at_s: Mapping[str, float] = field(default_factory=dict)

    @property
    def processes(self) -> Mapping[str, str]:
        """The names of the managers of other processes, by the names of the processes."""
        names = sorted({node.process for node in self.nodes if node.process})
        return {name: f"{self.name}/{name}" for name in names}

    def callbacks_at(self, process: str) -> float:
        """Return the time of the callbacks of a process, empty for the one that reports."""
        return self.processes_at_s.get(process, 0.0) if process else self.callbacks_at_s


@dataclass(frozen=True, slots=True)
class PartialReport:
    """What a manager of another version reports that this one knows: the states of its nodes."""

    name: str
    host: str
    pid: str
    is_ready: bool
    states: Mapping[str, str]


#: None stands for a system that did not respond.
AnyReport = TypeVar("AnyReport", SystemReport, SystemReport | None)

#: The name, the message and the values of a diagnostic status, as plain data.
Status: TypeAlias = tuple[str, str, Mapping[str, str]]


def parse_state(name: str, content: bytes) -> SystemReport:
    """Return the report of the system ``name`` in a serialized message.

    Raises InvalidReportError.
    """
    at_s, statuses = reported_statuses(content)
    return replace(system_report(name, statuses), at_s=at_s)


def reported_statuses(content: bytes) -> tuple[float, list[Status]]:
    """Return the time of a serialized message in seconds, and its statuses.

    Their values are without control characters. Raises InvalidReportError.
    """
    try:
        at_s, statuses = read_array(content)
    except ValueError as error:
        raise invalid_report(error) from error
    return at_s, [
        (name, message, {key: visible(text) for key, text in values.items()})
        for _, name, message, _, values in statuses
    ]


def system_report(name: str, statuses: Iterable[Status]) -> SystemReport:
    """Return the report of the system ``name`` from its status and those of its nodes.

    Raises InvalidReportError.
    """
    try:
        own, *nodes = _some(statuses)
        _, text, values = own
        return SystemReport(
            name=name,
            activity=values["activity"],
            message=visible(text),
            host=values["host"],
            pid=values["pid"],
            nodes=tuple(_node_report(node, each, values["host"]) for node, _, each in nodes),
            is_ready=values.get("ready") == "true",
        )
    except (ValueError, KeyError, TypeError) as error:
        raise invalid_report(error) from error


def _some(statuses: Iterable[Status]) -> list[Status]:
    """Return the statuses. Raises ValueError if there are none."""
    found = list(statuses)
    if not found:
        raise ValueError("it is empty")
    return found


def partial_report(name: str, content: bytes) -> PartialReport | None:
    """Return what is known of a system of another version; None if it is not a report at all."""
    try:
        _, [(_, _, values), *nodes] = reported_statuses(content)
    except (InvalidReportError, ValueError):
        return None
    if not {"activity", "host", "pid"} <= values.keys():
        return None
    return PartialReport(
        name=name,
        host=values["host"],
        pid=values["pid"],
        is_ready=values.get("ready") == "true",
        states={reported_node(node): values.get("state", "unknown") for node, _, values in nodes},
    )


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
    """Return reports by their names, without those of processes whose nodes another one has."""
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


def reported_node(status_name: str) -> str:
    """Return the full name of the node that a status of this name describes."""
    return visible(status_name).partition(": ")[2]


def invalid_report(error: Exception) -> InvalidReportError:
    """Return the error for a message without an expected value, or with an invalid one."""
    problem = "missing" if isinstance(error, KeyError) else "invalid"
    return InvalidReportError(
        f"not a report of this version of ros2-composer ({problem}: {error!s:.80})"
    )


def _node_report(status_name: str, values: Mapping[str, str], host: str) -> NodeReport:
    return NodeReport(
        node=reported_node(status_name),
        state=values["state"],
        desired=values["desired"],
        since_s=finite(values["since"]),
        restarts=whole(values["restarts"]),
        errors=whole(values["errors"]),
        last_error=values["last_error"],
        held_down=values["held_down"],
        condition=values["condition"],
        sent_hz=optional(values["sent_hz"]),
        received_hz=optional(values["received_hz"]),
        busy=optional(values["busy"]),
        slowest=values["slowest"],
        overruns=whole(values["overruns"]),
        queue_drops=whole(values["queue_drops"]),
        qos_events=_counts(values["qos_events"]),
        depends_on=_pairs(values["depends_on"]),
        sent=_counts(values["sent"]),
        received=_counts(values["received"]),
        dropped=_counts(values["dropped"]),
        process=values.get("process", ""),
        host=values.get("host", "") or host,
        pid=values.get("pid", ""),
    )


def _counts(text: str) -> dict[str, int]:
    """Parse counts by name, such as ``incompatible=1``. Raises ValueError."""
    return {name: whole(count) for name, count in _pairs(text).items()}


def _pairs(text: str) -> dict[str, str]:
    """Parse values by name, such as ``/planner=active``."""
    return {name: value for name, _, value in (item.partition("=") for item in text.split())}
