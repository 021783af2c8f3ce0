"""Layouts side by side, in rows like books on shelves, to one that fits a screen."""

from __future__ import annotations

import math
from collections.abc import Sequence

from composer.graph.layout.result import Layout, Point, Size

MARGIN = 16.0
#: Width to height of what is aimed at: a screen's, a page's on its side.
_ASPECT = 1.6


def side_by_side(layouts: Sequence[Layout]) -> Layout:
    """Return one layout of all parts."""
    area = sum(layout.size.width * layout.size.height for layout in layouts)
    widest = max((layout.size.width for layout in layouts), default=0.0)
    limit = max(widest, math.sqrt(area * _ASPECT))
    moved = [
        layout.moved(corner)
        for layout, corner in zip(layouts, _corners(layouts, limit), strict=True)
    ]
    # Every part has its own margin; between two parts one is enough.
    return Layout(
        size=Size(
            max((part.size.width for part in moved), default=2 * MARGIN),
            max((part.size.height for part in moved), default=2 * MARGIN),
        ),
        vertices={key: place for part in moved for key, place in part.vertices.items()},
        frames=tuple(frame for part in moved for frame in part.frames),
        paths=tuple(path for part in moved for path in part.paths),
    )


def _corners(layouts: Sequence[Layout], limit: float) -> list[Point]:
    corners = []
    x = y = height = 0.0
    for layout in layouts:
        if x > 0.0 and x + layout.size.width > limit:
            x, y, height = 0.0, y + height - MARGIN, 0.0
        corners.append(Point(x, y))
        x += layout.size.width - MARGIN
        height = max(height, layout.size.height)
    return corners
