"""Statistics of measurements: percentiles, ratios per round, and tables."""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Spread:
    """Median and range of the values of several rounds."""

    median: float
    lowest: float
    highest: float
    rounds: int


@dataclass(frozen=True, slots=True)
class Row:
    """One case, with the values of the composer and of a baseline per round; None for failures."""

    case: str
    unit: str
    baseline: str
    values: tuple[float | None, ...]
    baseline_values: tuple[float | None, ...]


def spread(values: Iterable[float | None]) -> Spread | None:
    """Return median, minimum and maximum without failures; None if all have failed."""
    present = [value for value in values if value is not None]
    if not present:
        return None
    return Spread(statistics.median(present), min(present), max(present), len(present))


def ratios(row: Row) -> list[float]:
    """Return the ratio composer / baseline of each round in which both succeeded.

    Ratios are computed per round, since the speed of the machine can change between rounds.
    """
    return [
        value / baseline
        for value, baseline in zip(row.values, row.baseline_values, strict=True)
        if value is not None and baseline
    ]


def percentile(values: Sequence[float], share: float) -> float:
    """Return the ``share`` percentile by the nearest-rank method.

    Raises ValueError if there are no values or ``share`` is not in the interval (0, 1].
    """
    if not values:
        raise ValueError("no values")
    if not 0.0 < share <= 1.0:
        raise ValueError(f"share must be in (0, 1], not {share}")
    rank = -(-len(values) * share // 1)
    return sorted(values)[int(rank) - 1]


def table(rows: Sequence[Row]) -> str:
    """Return the rows as an aligned table. A ratio below 1 means that the composer needs less."""
    head = ("case", "unit", "composer", "baseline", "value", "ratio", "min - max", "rounds")
    lines = [head, *(_cells(row) for row in rows)]
    return aligned(lines, right=(2, 4, 5, 6, 7))


def aligned(lines: Sequence[Sequence[str]], right: Sequence[int]) -> str:
    """Return lines with aligned columns; those in ``right`` are right-aligned."""
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join(
        "  ".join(
            cell.rjust(width) if column in right else cell.ljust(width)
            for column, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    )


def as_json(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Return the rows with all values, for further processing."""
    return [
        {
            "case": row.case,
            "unit": row.unit,
            "baseline": row.baseline,
            "values": list(row.values),
            "baseline_values": list(row.baseline_values),
            "ratios": ratios(row),
        }
        for row in rows
    ]


def _cells(row: Row) -> tuple[str, ...]:
    ratio = spread(ratios(row))
    return (
        row.case,
        row.unit,
        _figure(spread(row.values)),
        row.baseline,
        _figure(spread(row.baseline_values)),
        "-" if ratio is None else f"{ratio.median:.3g}",
        "-" if ratio is None else f"{ratio.lowest:.3g} - {ratio.highest:.3g}",
        f"{0 if ratio is None else ratio.rounds} of {len(row.values)}",
    )


def _figure(values: Spread | None) -> str:
    return "failed" if values is None else f"{values.median:.4g}"
