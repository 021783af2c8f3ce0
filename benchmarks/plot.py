"""A bar chart of the ratios: a bar for the median, a line from the minimum to the maximum."""

from __future__ import annotations

import math
from collections.abc import Iterable
from html import escape

from benchmarks.figures import Row, Spread, ratios, spread

_LOWEST, _HIGHEST = 0.001, 10.0  # other ratios are clipped
_LABELS_PX, _BARS_PX, _LINE_PX, _MARGIN_PX = 520, 440, 22, 30
_GRID = (0.001, 0.01, 0.1, 1.0, 10.0)
_OURS, _THEIRS = "#2a9d8f", "#e76f51"


def chart(rows: Iterable[Row]) -> str:
    """Return an SVG image with a logarithmic scale. Below 1, the composer needs less."""
    bars = [(row, ratio) for row in rows if (ratio := spread(ratios(row))) is not None]
    height = 2 * _MARGIN_PX + _LINE_PX * len(bars)
    width = _LABELS_PX + _BARS_PX + _MARGIN_PX
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
            'font-family="sans-serif" font-size="12">',
            f'<rect width="{width}" height="{height}" fill="white"/>',
            *_grid(height),
            *(line for place, item in enumerate(bars) for line in _bar(place, *item)),
            "</svg>\n",
        ]
    )


def _grid(height: int) -> Iterable[str]:
    for ratio in _GRID:
        x = _x(ratio)
        color = "black" if ratio == 1.0 else "#cccccc"
        yield (
            f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{_MARGIN_PX}" y2="{height - _MARGIN_PX}" '
            f'stroke="{color}"/>'
        )
        yield f'<text x="{x:.1f}" y="{_MARGIN_PX - 8}" text-anchor="middle">{ratio:g}</text>'


def _bar(place: int, row: Row, ratio: Spread) -> Iterable[str]:
    top = _MARGIN_PX + place * _LINE_PX
    middle = top + _LINE_PX / 2
    first, last = sorted((_x(1.0), _x(ratio.median)))
    color = _OURS if ratio.median <= 1.0 else _THEIRS
    label = escape(f"{row.case}, {row.unit}, baseline {row.baseline}: {ratio.median:.3g}")
    yield f'<text x="{_LABELS_PX - 10}" y="{middle + 4}" text-anchor="end">{label}</text>'
    yield (
        f'<rect x="{first:.1f}" y="{top + 4}" width="{last - first:.1f}" '
        f'height="{_LINE_PX - 8}" fill="{color}"/>'
    )
    yield (
        f'<line x1="{_x(ratio.lowest):.1f}" x2="{_x(ratio.highest):.1f}" y1="{middle}" '
        f'y2="{middle}" stroke="black"/>'
    )


def _x(ratio: float) -> float:
    """Return the x coordinate of a ratio."""
    clipped = min(max(ratio, _LOWEST), _HIGHEST)
    share = math.log(clipped / _LOWEST) / math.log(_HIGHEST / _LOWEST)
    return _LABELS_PX + share * _BARS_PX
