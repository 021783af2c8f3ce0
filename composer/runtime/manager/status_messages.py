"""The status of a system as it is published: one diagnostic status for it and each node."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from composer.runtime.metrics.figures import ChainFigures
from composer.runtime.ros.diagnostic_arrays import Level, Status, optional_text
from composer.runtime.supervision.status import NodeStatus, SystemStatus

_MAX_LENGTH = 500


def status_message(
    status: SystemStatus,
    uptime_s: float,
    chains: Iterable[ChainFigures],
    number: int,
    process: Mapping[str, str] | None = None,
) -> list[Status]:
    """Return the status of a system, followed by those of its nodes.

    ``number`` is that of the last message on the topic ``state``, this one included.
    ``process`` is what only the coordinating process needs to know of another one.
    """
    nodes = (_of_node(status.system, node) for node in status.nodes)
    return [_of_system(status, uptime_s, chains, number, process or {}), *nodes]


def _of_system(
    status: SystemStatus,
    uptime_s: float,
    chains: Iterable[ChainFigures],
    number: int,
    process: Mapping[str, str],
) -> Status:
    level = Level.OK
    if status.failed:
        level = Level.ERROR
    elif not status.is_active:
        level = Level.WARN
    values = {
        "activity": status.activity,
        "active": str(status.is_active).lower(),
        "ready": str(status.is_ready).lower(),
        "host": status.host,
        "pid": str(status.pid),
        "started": f"{status.started_s:.3f}",
        "uptime": f"{uptime_s:.3f}",
        "number": str(number),
        "is_child": str(status.is_child).lower(),
        **process,
    }
    values |= {f"chain {chain.chain}": chain.text for chain in chains}
    goals = {"goals": status.goals} if status.goals else {}  # not cut either
    name = status.system
    return Status(level, name, _cut(status.summary), name, _cut_all(values) | goals)


def _of_node(system: str, node: NodeStatus) -> Status:
    level = Level.OK
    message = node.state
    if node.held_down:
        level = Level.ERROR if node.is_required else Level.WARN
        message = f"{node.state} ({node.condition or 'failed'}): {node.held_down}"
    elif node.condition:
        level = Level.WARN
        message = f"{node.state} ({node.condition})"
    elif node.state != "active":
        level = Level.WARN
    values = {
        "state": node.state,
        "desired": node.desired,
        "depends_on": " ".join(f"{on}={state}" for on, state in node.depends_on.items()),
        "process": node.process,
        "host": node.host,
        "pid": node.pid,
        "left_to_manager": " ".join(node.left_to_manager),
        "since": f"{node.since_s:.3f}",
        "restarts": str(node.restarts),
        "errors": str(node.errors),
        "last_error": node.last_error,
        "held_down": node.held_down,
        "condition": node.condition,
        "sent_hz": optional_text(node.sent_hz, 1),
        "received_hz": optional_text(node.received_hz, 1),
        "busy": optional_text(node.busy, 4),
        "slowest": node.slowest,
        "overruns": str(node.overruns),
        "queue_drops": str(node.queue_drops),
        "calls": str(node.calls),
        "skipped": str(node.skipped),
        "qos_events": _pairs(node.qos_events),
    }
    # A part of the name of a topic would be another name, so these are not cut.
    counts = {
        "sent": _pairs(node.sent),
        "received": _pairs(node.received),
        "dropped": _pairs(node.dropped),
    }
    name = f"{system}: {node.node}"
    return Status(level, name, _cut(message), system, _cut_all(values) | counts)


def _pairs(counts: Mapping[str, int]) -> str:
    """Return counts by name as text."""
    return " ".join(f"{name}={count}" for name, count in counts.items())


def _cut_all(values: dict[str, str]) -> dict[str, str]:
    return {key: _cut(value) for key, value in values.items()}


def _cut(text: str) -> str:
    """Return the beginning of a text that user code or another node may have made long."""
    return text if len(text) <= _MAX_LENGTH else f"{text[:_MAX_LENGTH]}..."
