"""Converts figures of callbacks and chains to and from diagnostic_msgs/msg/DiagnosticArray."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import fields
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from composer.runtime.metrics.figures import CallbackFigures, ChainFigures
from composer.runtime.metrics.numbers import finite

Figures = CallbackFigures | ChainFigures


def to_message(system: str, figures: Iterable[Figures]) -> DiagnosticArray:
    """Return a message with one status for each; overruns, drops and late data are warnings."""
    return DiagnosticArray(status=[_status(system, item) for item in figures])


def from_message(
    message: DiagnosticArray,
) -> tuple[tuple[CallbackFigures, ...], tuple[ChainFigures, ...]]:
    """Return the callbacks and chains of a message of :func:`to_message`.

    Raises ValueError, KeyError or TypeError for any other message.
    """
    values = [
        {item.key: _TYPES[item.key](item.value) for item in status.values}
        for status in message.status
    ]
    return (
        tuple(CallbackFigures(**item) for item in values if "chain" not in item),
        tuple(ChainFigures(**item) for item in values if "chain" in item),
    )


_PARSERS: dict[str, Callable[[str], Any]] = {"int": int, "float": finite, "str": str}
#: Converts each field back from text.
_TYPES = {
    field.name: _PARSERS[str(field.type)]
    for kind in (CallbackFigures, ChainFigures)
    for field in fields(kind)
}


def _status(system: str, figures: Figures) -> DiagnosticStatus:
    if isinstance(figures, ChainFigures):
        name, is_ok, text = f"chain {figures.chain}", not figures.late, figures.text
    else:
        name = f"{figures.node} {figures.callback}"
        is_ok = not (figures.overruns or figures.dropped)
        text = f"{figures.overruns} over budget, {figures.dropped} dropped"
    values = {field.name: getattr(figures, field.name) for field in fields(figures)}
    return DiagnosticStatus(
        level=DiagnosticStatus.OK if is_ok else DiagnosticStatus.WARN,
        name=f"{system}: {name}",
        message=text,
        hardware_id=system,
        values=[KeyValue(key=key, value=_text(value)) for key, value in values.items()],
    )


def _text(value: str | float) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
