"""Diagrams as one page that needs nothing else: no network, no server, no installed program.

``page`` puts it together; ``articles`` writes what is known about each thing. What the page looks
like is in ``page.css``; what it does is in the ``.js`` files, one matter each, joined in the order
that ``page`` names.
"""

from __future__ import annotations

from composer.graph.html.page import render

__all__ = ["render"]
