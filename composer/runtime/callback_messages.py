"""The figures of callbacks as a manager tells them: ``diagnostic_msgs/msg/DiagnosticArray``."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from composer.runtime.figures import CallbackFigures

#: Which type each field has, for the way back from text.
_TYPES = {
    field.name: {"int": int, "float": float}.get(str(field.type), str)
    for field in fields(CallbackFigures)
}


def to_message(system: str, callbacks: Iterable[CallbackFigures]) -> DiagnosticArray:
    """Return a message with a status for each callback; one that overran its budget warns."""
    return DiagnosticArray(status=[_status(system, callback) for callback in callbacks])


def from_message(message: DiagnosticArray) -> tuple[CallbackFigures, ...]:
    """Return what :func:`to_message` was given."""
    return tuple(
        CallbackFigures(**{item.key: _TYPES[item.key](item.value) for item in status.values})
        for status in message.status
    )


def _status(system: str, callback: CallbackFigures) -> DiagnosticStatus:
    late = callback.overruns or callback.dropped
    values = {field.name: getattr(callback, field.name) for field in fields(callback)}
    return DiagnosticStatus(
        level=DiagnosticStatus.WARN if late else DiagnosticStatus.OK,
        name=f"{system}: {callback.node} {callback.callback}",
        message=f"{callback.overruns} over budget, {callback.dropped} dropped" if late else "",
        hardware_id=system,
        values=[KeyValue(key=key, value=_text(value)) for key, value in values.items()],
    )


def _text(value: str | float) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
