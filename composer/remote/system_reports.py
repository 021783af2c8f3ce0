"""What manager nodes report about their systems, read from diagnostic_msgs/msg/DiagnosticArray.

The messages may be those of another version, or of any node that publishes on the same topic.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, TypeAlias

from composer.fast_dataclass import dataclass
from composer.report.display import visible
from composer.runtime.metrics.figures import CallbackFigures, ChainFigures
from composer.runtime.metrics.numbers import finite

if TYPE_CHECKING:  # a report may also come from a query, without ROS
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus


class InvalidReportError(Exception):
    """A message is not a report of this version of the manager node."""


@dataclass(frozen=True, slots=True)
class NodeReport:
    """A node as its manager reports it. ``since_s`` is in seconds since 1970.

    ``depends_on`` are the states that the nodes it depends on must have, by their full names.
    ``sent``, ``received`` and ``dropped`` count messages by topic; the last is without zeros.
    """

    node: str
    state: str
    desired: str
    since_s: float
    restarts: int
    errors: int
    last_error: str
    held_down: str
    sent_hz: float
    received_hz: float
    busy: float
    slowest: str
    overruns: int
    queue_drops: int
    qos_events: Mapping[str, int]
    depends_on: Mapping[str, str]
    sent: Mapping[str, int]
    received: Mapping[str, int]
    dropped: Mapping[str, int]


@dataclass(frozen=True, slots=True)
class SystemReport:
    """A system as its manager reports it. ``name`` is the namespace of the manager.

    ``at_s`` is the time of a report that was published, in seconds since 1970 or simulated time.
    ``callbacks`` and ``chains`` are included on request, with their time ``callbacks_at_s``.
    """

    name: str
    activity: str
    message: str
    host: str
    pid: str
    nodes: tuple[NodeReport, ...]
    at_s: float = 0.0
    callbacks: tuple[CallbackFigures, ...] = ()
    chains: tuple[ChainFigures, ...] = ()
    callbacks_at_s: float = 0.0


#: The name, the message and the values of a diagnostic status, as plain data.
Status: TypeAlias = tuple[str, str, Mapping[str, str]]


def parse_state(name: str, message: DiagnosticArray) -> SystemReport:
    """Return the report of the system ``name``. Raises InvalidReportError."""
    statuses = [(status.name, status.message, report_values(status)) for status in message.status]
    stamp = message.header.stamp
    at_s = float(stamp.sec + stamp.nanosec * 1e-9)
    return replace(system_report(name, statuses), at_s=at_s)


def system_report(name: str, statuses: Iterable[Status]) -> SystemReport:
    """Return the report of the system ``name`` from its status and those of its nodes.

    Raises InvalidReportError.
    """
    try:
        (_, text, values), *nodes = statuses
        return SystemReport(
            name=name,
            activity=values["activity"],
            message=visible(text),
            host=values["host"],
            pid=values["pid"],
            nodes=tuple(_node_report(node, values) for node, _, values in nodes),
        )
    except (ValueError, KeyError, TypeError) as error:
        raise invalid_report(error) from error


def report_values(status: DiagnosticStatus) -> Mapping[str, str]:
    """Return the values of a status by their keys, without control characters."""
    return {item.key: visible(item.value) for item in status.values}


def reported_node(status: DiagnosticStatus) -> str:
    """Return the full name of the node that a status describes."""
    return _node_name(status.name)


def _node_name(status_name: str) -> str:
    return visible(status_name).partition(": ")[2]


def invalid_report(error: Exception) -> InvalidReportError:
    """Return the error for a message without an expected value, or with an invalid one."""
    problem = "missing" if isinstance(error, KeyError) else "invalid"
    return InvalidReportError(
        f"not a report of this version of ros2-composer ({problem}: {error!s:.80})"
    )


def _node_report(status_name: str, values: Mapping[str, str]) -> NodeReport:
    return NodeReport(
        node=_node_name(status_name),
        state=values["state"],
        desired=values["desired"],
        since_s=finite(values["since"]),
        restarts=int(values["restarts"]),
        errors=int(values["errors"]),
        last_error=values["last_error"],
        held_down=values["held_down"],
        sent_hz=finite(values["sent_hz"]),
        received_hz=finite(values["received_hz"]),
        busy=finite(values["busy"]),
        slowest=values["slowest"],
        overruns=int(values["overruns"]),
        queue_drops=int(values["queue_drops"]),
        qos_events=_counts(values["qos_events"]),
        depends_on=_pairs(values["depends_on"]),
        sent=_counts(values["sent"]),
        received=_counts(values["received"]),
        dropped=_counts(values["dropped"]),
    )


def _counts(text: str) -> dict[str, int]:
    """Parse counts by name, such as ``incompatible=1``. Raises ValueError."""
    return {name: int(count) for name, count in _pairs(text).items()}


def _pairs(text: str) -> dict[str, str]:
    """Parse values by name, such as ``/planner=active``."""
    return {name: value for name, _, value in (item.partition("=") for item in text.split())}
