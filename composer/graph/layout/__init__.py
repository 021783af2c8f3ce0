"""Where everything in a diagram goes, without Graphviz: a layered layout with nested frames.

The steps are those of Sugiyama, Tagawa and Toda (1981): ranks along the direction of the arrows
(``ranks``), an order across it with few crossings (``order``), straight edges (``straighten``), and
lines through the bends (``routes``). A frame is one lane across the ranks, so frames never overlap.
Positions are in pixels; the same graph is always laid out in the same way.

What lines have in common they share (``build``): a topic that everybody hears is a tree, not a
thicket. Ports of a block are rows of one box (``solids``).
"""

from __future__ import annotations

from composer.graph.layout.arrange import LayOut, arrange
from composer.graph.layout.result import Frame, Layout, Path, Place, Point, Size
from composer.graph.layout.solids import Sizes

__all__ = ["Frame", "LayOut", "Layout", "Path", "Place", "Point", "Size", "Sizes", "arrange"]
