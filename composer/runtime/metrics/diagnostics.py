"""Converts figures of callbacks and chains to and from diagnostic statuses, and text."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
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
    return _from_values(status.values for status in statuses)


def to_text(figures: Iterable[Figures]) -> str:
    """Return callbacks and chains as text, without histograms."""
    values = [status.values for status in to_statuses("", figures)]
    for item in values:
        item.pop("histogram", None)
    return json.dumps(values)


def from_text(text: str) -> tuple[tuple[CallbackFigures, ...], tuple[ChainFigures, ...]]:
    """Return the callbacks and chains of a text of :func:`to_text`. Raises ValueError."""
    try:
        return _from_values(json.loads(text))
    except (KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ValueError("not the timings of this version") from error


def _from_values(
    values: Iterable[Mapping[str, str]],
) -> tuple[tuple[CallbackFigures, ...], tuple[ChainFigures, ...]]:
    typed = [{key: _TYPES[key](value) for key, value in item.items()} for item in values]
    return (
        tuple(CallbackFigures(**item) for item in typed if "chain" not in item),
        tuple(ChainFigures(**item) for item in typed if "chain" in item),
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
