"""Converts figures of callbacks and chains to and from diagnostic statuses."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import fields
from typing import Any

from composer.runtime.metrics.figures import CallbackFigures, ChainFigures
from composer.runtime.metrics.numbers import finite
from composer.runtime.ros.diagnostic_arrays import Level, Status

Figures = CallbackFigures | ChainFigures


def to_statuses(system: str, figures: Iterable[Figures]) -> list[Status]:
    """Return one status for each; overruns, drops and late data are warnings."""
    return [_status(system, item) for item in figures]


def from_statuses(
    statuses: Iterable[Status],
) -> tuple[tuple[CallbackFigures, ...], tuple[ChainFigures, ...]]:
    """Return the callbacks and chains of statuses of :func:`to_statuses`.

    Raises ValueError, KeyError or TypeError for any others.
    """
    values = [
        {key: _TYPES[key](value) for key, value in status.values.items()} for status in statuses
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


def _status(system: str, figures: Figures) -> Status:
    if isinstance(figures, ChainFigures):
        name, is_ok, text = f"chain {figures.chain}", not figures.late, figures.text
    else:
        name = f"{figures.node} {figures.callback}"
        is_ok = not (figures.overruns or figures.dropped)
        text = f"{figures.overruns} over budget, {figures.dropped} dropped"
    values = {field.name: getattr(figures, field.name) for field in fields(figures)}
    level = Level.OK if is_ok else Level.WARN
    texts = {key: _text(value) for key, value in values.items()}
    return Status(level, f"{system}: {name}", text, system, texts)


def _text(value: str | float) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
