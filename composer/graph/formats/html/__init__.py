"""Diagrams as one self-contained HTML page: no network, no server, no installed program.

``page`` assembles the page and ``articles`` the details of each entity. The style is in
``page.css``, the behavior in the ``.js`` files, which ``page`` joins in order.
"""

from __future__ import annotations

from composer.graph.formats.html.page import render

__all__ = ["render"]
