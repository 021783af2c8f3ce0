"""The timings of callbacks and chains that manager nodes publish."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

from composer.base.characters import visible
from composer.base.fast_dataclass import dataclass
from composer.client.systems.system_reports import invalid_report
from composer.runtime.metrics.figures import CallbackFigures, ChainFigures, from_statuses
from composer.runtime.ros.diagnostic_arrays import read_array

F = TypeVar("F", CallbackFigures, ChainFigures)


@dataclass(frozen=True, slots=True)
class CallbackReport:
    """The timings of callbacks and chains at ``at_s``, in seconds since 1970."""

    callbacks: tuple[CallbackFigures, ...]
    chains: tuple[ChainFigures, ...]
    at_s: float


def parse_callbacks(content: bytes) -> CallbackReport:
    """Return the timings in a serialized message of a manager. Raises InvalidReportError."""
    try:
        at_s, statuses = read_array(content)
        callbacks, chains = from_statuses(statuses)
    except (ValueError, KeyError, TypeError) as error:
        raise invalid_report(error) from error
    return CallbackReport(tuple(map(_visible, callbacks)), tuple(map(_visible, chains)), at_s)


def _visible(figures: F) -> F:
    texts = {
        field: visible(value)
        for field in figures.__dataclass_fields__
        if isinstance(value := getattr(figures, field), str)
    }
    return replace(figures, **texts)  # type: ignore[arg-type]  # all of them are strings
