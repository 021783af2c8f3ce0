"""What is made of measurements: percentiles, ratios round by round, and the table."""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Spread:
    """The middle and the ends of what several rounds gave."""

    median: float
    lowest: float
    highest: float
    rounds: int


@dataclass(frozen=True, slots=True)
class Row:
    """One case against one way of doing it by hand; an entry per round, None where it failed."""

    case: str
    unit: str
    against: str
    ours: tuple[float | None, ...]
    theirs: tuple[float | None, ...]


def spread(values: Iterable[float | None]) -> Spread | None:
    """Return median, least and greatest of what is there; None when nothing is."""
    present = [value for value in values if value is not None]
    if not present:
        return None
    return Spread(statistics.median(present), min(present), max(present), len(present))


def ratios(row: Row) -> list[float]:
    """Return ours / theirs of each round in which both succeeded.

    Within a round, because the machine is the same there; from round to round it may not be.
    """
    return [
        ours / theirs
        for ours, theirs in zip(row.ours, row.theirs, strict=True)
        if ours is not None and theirs
    ]


def percentile(values: Sequence[float], share: float) -> float:
    """Return the smallest value that at least ``share`` of all do not exceed (nearest rank).

    Raises ValueError when there are no values or ``share`` is not within 0 (excluded) and 1.
    """
    if not values:
        raise ValueError("no values")
    if not 0.0 < share <= 1.0:
        raise ValueError(f"not a share: {share}")
    rank = -(-len(values) * share // 1)
    return sorted(values)[int(rank) - 1]


def table(rows: Sequence[Row]) -> str:
    """Return the rows as aligned text, a ratio below 1 meaning that the composer needs less."""
    head = ("case", "unit", "ours", "against", "theirs", "ratio", "least - most", "rounds")
    lines = [head, *(_cells(row) for row in rows)]
    return aligned(lines, right=(2, 4, 5, 6, 7))


def aligned(lines: Sequence[Sequence[str]], right: Sequence[int]) -> str:
    """Return lines with their cells in columns, those of ``right`` aligned there."""
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join(
        "  ".join(
            cell.rjust(width) if column in right else cell.ljust(width)
            for column, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    )


def as_json(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Return the rows with every single figure, for whoever wants to count otherwise."""
    return [
        {
            "case": row.case,
            "unit": row.unit,
            "against": row.against,
            "ours": list(row.ours),
            "theirs": list(row.theirs),
            "ratios": ratios(row),
        }
        for row in rows
    ]


def _cells(row: Row) -> tuple[str, ...]:
    ratio = spread(ratios(row))
    return (
        row.case,
        row.unit,
        _figure(spread(row.ours)),
        row.against,
        _figure(spread(row.theirs)),
        "-" if ratio is None else f"{ratio.median:.3g}",
        "-" if ratio is None else f"{ratio.lowest:.3g} - {ratio.highest:.3g}",
        f"{0 if ratio is None else ratio.rounds} of {len(row.ours)}",
    )


def _figure(found: Spread | None) -> str:
    return "failed" if found is None else f"{found.median:.4g}"
