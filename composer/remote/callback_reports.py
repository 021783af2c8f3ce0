"""The timings of callbacks and chains that manager nodes publish."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

from diagnostic_msgs.msg import DiagnosticArray

from composer.fast_dataclass import dataclass
from composer.remote.system_reports import invalid_report
from composer.report.display import visible
from composer.runtime.metrics.diagnostics import from_message
from composer.runtime.metrics.figures import CallbackFigures, ChainFigures

F = TypeVar("F", CallbackFigures, ChainFigures)


@dataclass(frozen=True, slots=True)
class CallbackReport:
    """The timings of callbacks and chains at ``at_s``, in seconds since 1970."""

    callbacks: tuple[CallbackFigures, ...]
    chains: tuple[ChainFigures, ...]
    at_s: float


def parse_callbacks(message: DiagnosticArray) -> CallbackReport:
    """Return the timings in a message of a manager. Raises InvalidReportError."""
    try:
        callbacks, chains = from_message(message)
    except (ValueError, KeyError, TypeError) as error:
        raise invalid_report(error) from error
    stamp = message.header.stamp
    at_s = float(stamp.sec + stamp.nanosec * 1e-9)
    return CallbackReport(tuple(map(_visible, callbacks)), tuple(map(_visible, chains)), at_s)


def _visible(figures: F) -> F:
    texts = {
        field: visible(value)
        for field in figures.__dataclass_fields__
        if isinstance(value := getattr(figures, field), str)
    }
    return replace(figures, **texts)  # type: ignore[arg-type]  # all of them are strings
