"""Converts the status of a system to diagnostic_msgs/msg/DiagnosticArray."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from composer.runtime.metrics.figures import ChainFigures
from composer.runtime.supervision.status import NodeStatus, SystemStatus

_MAX_LENGTH = 500


def status_message(
    status: SystemStatus, uptime_s: float, chains: Iterable[ChainFigures]
) -> DiagnosticArray:
    """Return the status of a system, followed by those of its nodes."""
    nodes = (_of_node(status.system, node) for node in status.nodes)
    return DiagnosticArray(status=[_of_system(status, uptime_s, chains), *nodes])


def _of_system(
    status: SystemStatus, uptime_s: float, chains: Iterable[ChainFigures]
) -> DiagnosticStatus:
    level = DiagnosticStatus.OK
    if status.failed:
        level = DiagnosticStatus.ERROR
    elif not status.is_active:
        level = DiagnosticStatus.WARN
    values = {
        "activity": status.activity,
        "active": str(status.is_active).lower(),
        "host": status.host,
        "pid": str(status.pid),
        "started": f"{status.started_s:.3f}",
        "uptime": f"{uptime_s:.3f}",
    }
    values |= {f"chain {chain.chain}": chain.text for chain in chains}
    return _status(status.system, status.system, level, status.summary, values)


def _of_node(system: str, node: NodeStatus) -> DiagnosticStatus:
    level = DiagnosticStatus.OK
    message = node.state
    if node.held_down:
        level = DiagnosticStatus.ERROR
        message = f"{node.state}: {node.held_down}"
    elif node.state != "active":
        level = DiagnosticStatus.WARN
    values = {
        "state": node.state,
        "desired": node.desired,
        "depends_on": " ".join(f"{on}={state}" for on, state in node.depends_on.items()),
        "left_to_manager": " ".join(node.left_to_manager),
        "since": f"{node.since_s:.3f}",
        "restarts": str(node.restarts),
        "errors": str(node.errors),
        "last_error": node.last_error,
        "held_down": node.held_down,
        "sent_hz": f"{node.sent_hz:.1f}",
        "received_hz": f"{node.received_hz:.1f}",
        "busy": f"{node.busy:.4f}",
        "slowest": node.slowest,
        "overruns": str(node.overruns),
        "queue_drops": str(node.queue_drops),
        "qos_events": _pairs(node.qos_events),
    }
    status = _status(f"{system}: {node.node}", system, level, message, values)
    for key, counts in (("sent", node.sent), ("received", node.received)):
        status.values.append(KeyValue(key=key, value=_pairs(counts)))
    status.values.append(KeyValue(key="dropped", value=_pairs(node.dropped)))
    return status


def _pairs(counts: Mapping[str, int]) -> str:
    """Return counts by name as text, which is not cut: a part of a name would be another name."""
    return " ".join(f"{name}={count}" for name, count in counts.items())


def _status(
    name: str, system: str, level: bytes, message: str, values: dict[str, str]
) -> DiagnosticStatus:
    return DiagnosticStatus(
        level=level,
        name=name,
        message=_cut(message),
        hardware_id=system,
        values=[KeyValue(key=key, value=_cut(value)) for key, value in values.items()],
    )


def _cut(text: str) -> str:
    """Return the beginning of a text that user code or another node may have made long."""
    return text if len(text) <= _MAX_LENGTH else f"{text[:_MAX_LENGTH]}..."
