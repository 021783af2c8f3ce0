"""Layered graph drawing with nested frames (Sugiyama, Tagawa and Toda, 1981).

The steps are: sizes of texts (``geometry``), rank assignment (``ordering``), boxes for vertices,
labels and bends (``build``), ordering with few crossings (``ordering``), coordinate assignment
(``coordinates``) and edge routing (``routing``). ``pages`` runs them on each connected graph, and
puts the results on a page. A frame is one lane across the ranks, so frames
never overlap. Positions are in pixels, and the layout is deterministic.
"""

from __future__ import annotations

from composer.graph.layout.geometry import Frame, Layout, Path, Point, Rectangle, Size
from composer.graph.layout.pages import arrange, arrange_for_pages

__all__ = [
    "Frame",
    "Layout",
    "Path",
    "Point",
    "Rectangle",
    "Size",
    "arrange",
    "arrange_for_pages",
]
