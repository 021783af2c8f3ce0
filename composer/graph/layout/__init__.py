"""Where everything in a diagram goes, without Graphviz: a layered layout with nested frames.

The steps are those of Sugiyama, Tagawa and Toda (1981): ranks along the direction of the arrows
(``ranks``), an order across it with few crossings (``order``), straight edges (``straighten``), and
lines through the bends (``routes``). A frame is one lane across the ranks, so frames never overlap.
Positions are in pixels; the same graph is always laid out in the same way.
"""

from __future__ import annotations

from composer.graph.layout.arrange import arrange
from composer.graph.layout.build import Sizes
from composer.graph.layout.result import Frame, Layout, Path, Place, Point, Size

__all__ = ["Frame", "Layout", "Path", "Place", "Point", "Size", "Sizes", "arrange"]
