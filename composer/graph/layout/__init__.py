"""Layered graph drawing with nested frames (Sugiyama, Tagawa and Toda, 1981).

The steps, in ``steps``, are: rank assignment (``ranks``), ordering with few crossings
(``ordering``, ``transpose``), coordinate assignment (``coordinates``) and edge routing
(``routing``). A frame is one lane across the ranks, so frames never overlap. Positions are in
pixels, and the layout is deterministic. Edges with a common end share segments (``build``). Ports
of a block are rows of one box (``units``). Components that differ only in names are laid out once
(``alike``).
"""

from __future__ import annotations

from composer.graph.layout.arrange import LayOut, arrange
from composer.graph.layout.fitting import Arrangement, arrange_for_pages
from composer.graph.layout.result import Frame, Layout, Path, Point, Rectangle, Size
from composer.graph.layout.units import Sizes

__all__ = [
    "Arrangement",
    "Frame",
    "LayOut",
    "Layout",
    "Path",
    "Point",
    "Rectangle",
    "Size",
    "Sizes",
    "arrange",
    "arrange_for_pages",
]
