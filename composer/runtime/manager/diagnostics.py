"""The messages on ``/diagnostics`` (REP 107): a status of the system, each node and each callback.

They are for tools of ROS. What commands and other processes need is in the reports of
:mod:`composer.runtime.protocol`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields
from functools import lru_cache
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.time import Time

from composer.runtime.protocol.reports import (
    CallbackFigures,
    ChainFigures,
    NodeReport,
    SystemReport,
)

#: Most values are as in the message before, and making them again takes most of the time.
_KEPT_VALUES = 8192
#: The name of the node is that of its status.
_NODE_FIELDS = tuple(
    field.name
    for field in fields(NodeReport)
    if field.name not in ("node", "since_s", "starts_active", "is_required", "is_optional")
)
_CALLBACK_FIELDS = [field.name for field in fields(CallbackFigures)]


def diagnostic_array(
    report: SystemReport,
    uptime_s: float,
    chains: Iterable[ChainFigures],
    callbacks: Iterable[CallbackFigures],
) -> DiagnosticArray:
    """Return the message about a system, its nodes and its callbacks, with the report's time."""
    statuses = [
        _of_system(report, uptime_s, chains),
        *(_of_node(report.name, node) for node in report.nodes),
        *(_of_callback(report.name, callback) for callback in callbacks),
    ]
    message = DiagnosticArray(status=statuses)
    message.header.stamp = Time(nanoseconds=int(report.at_s * 1e9)).to_msg()
    return message


def _of_system(
    report: SystemReport, uptime_s: float, chains: Iterable[ChainFigures]
) -> DiagnosticStatus:
    level = DiagnosticStatus.OK
    if report.failed:
        level = DiagnosticStatus.ERROR
    elif not report.is_active:
        level = DiagnosticStatus.WARN
    values = {
        "activity": report.activity,
        "active": report.is_active,
        "ready": report.is_ready,
        "host": report.host,
        "pid": report.pid,
        "started": f"{report.started_s:.3f}",
        "uptime": f"{uptime_s:.3f}",
    }
    values |= {f"chain {chain.chain}": chain.text for chain in chains}
    return _status(level, report.name, report.name, report.message, values)


def _of_node(system: str, node: NodeReport) -> DiagnosticStatus:
    level = DiagnosticStatus.OK
    message = node.state
    if node.held_down:
        level = DiagnosticStatus.ERROR if node.is_required else DiagnosticStatus.WARN
        message = f"{node.state} ({node.condition or 'failed'}): {node.held_down}"
    elif node.condition:
        level = DiagnosticStatus.WARN
        message = f"{node.state} ({node.condition})"
    elif node.state != "active":
        level = DiagnosticStatus.WARN
    values = {name: getattr(node, name) for name in _NODE_FIELDS}
    values["since"] = f"{node.since_s:.3f}"
    return _status(level, system, f"{system}: {node.node}", message, values)


def _of_callback(system: str, figures: CallbackFigures) -> DiagnosticStatus:
    is_ok = not (figures.overruns or figures.dropped)
    values = {name: getattr(figures, name) for name in _CALLBACK_FIELDS}
    return _status(
        DiagnosticStatus.OK if is_ok else DiagnosticStatus.WARN,
        system,
        f"{system}: {figures.node} {figures.callback}",
        f"{figures.overruns} over budget, {figures.dropped} dropped",
        values,
    )


def _status(
    level: bytes, system: str, name: str, message: str, values: Mapping[str, Any]
) -> DiagnosticStatus:
    return DiagnosticStatus(
        level=level,
        name=_valid(name),
        message=_valid(message),
        hardware_id=system,
        values=[
            _value(key, tuple(value.items()) if isinstance(value, dict) else value)
            for key, value in values.items()
        ],
    )


@lru_cache(_KEPT_VALUES, typed=True)
def _value(key: str, value: Any) -> KeyValue:
    return KeyValue(key=_valid(key), value=_valid(_text(value)))


def _valid(text: str) -> str:
    """Return a text that rclpy can send: errors of user code may have half surrogates."""
    return text if text.isascii() else text.encode(errors="replace").decode()


def _text(value: Any) -> str:
    """Return a value in words: ``true``, ``0.5``, ``/scan=3 /odom=4``, and nothing for None."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, tuple):
        return " ".join(item if isinstance(item, str) else "{}={}".format(*item) for item in value)
    return "" if value is None else str(value)
