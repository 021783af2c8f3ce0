"""Which scripts and styles the page consists of, so that the browser loads them all at once.

By itself, it finds the imports of a module only when it has loaded the module. Styles are one file:
each request takes both sides a few milliseconds.
"""

from __future__ import annotations

import re
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from posixpath import dirname, join, normpath

PAGE = files("composer.dashboard") / "page"
#: Scripts and styles that the page shares with the pages of ``compose graph``.
GRAPH_FILES = files("composer.graph.formats.html")
_GRAPH_FOLDER = "graph/"
_IMPORT = re.compile(r'^(?:import|export)\b[^;"]*"(\.\.?/[^"]+)"', re.MULTILINE)
_MAIN = "main.js"
#: Later ones replace rules of those before them.
_STYLES = (
    "vendor/uplot/uPlot.min.css",
    *("style/base.css", "style/controls.css", "style/views.css"),
    *("graph/picture.css", "style/graph.css"),
)
#: Views that are shown by the module of another one.
_SHARED = {"": "graph", "actions": "services"}


@cache
def index_of(view: str) -> bytes:
    """Return the HTML of the page; ``view`` is the first part of the address."""
    modules = dict.fromkeys((*_closure(_MAIN), *_closure(f"views/{_SHARED.get(view, view)}.js")))
    links = "".join(f'<link rel="modulepreload" href="/page/{name}">\n' for name in modules)
    text = (PAGE / "index.html").read_text(encoding="utf-8")
    return text.replace("</head>", f"{links}</head>", 1).encode()


@cache
def style_sheet() -> bytes:
    """Return the styles of the page, after those of diagrams."""
    from composer.graph.formats.theme import page_style

    texts = (file_of_page(name).read_text(encoding="utf-8") for name in _STYLES)
    return "\n".join((page_style(), *texts)).encode()


def file_of_page(path: str) -> Traversable:
    """Return a file by its address below ``/page``; it need not exist."""
    if path.startswith(_GRAPH_FOLDER):
        return GRAPH_FILES.joinpath(*path.removeprefix(_GRAPH_FOLDER).split("/"))
    return PAGE.joinpath(*path.split("/"))


def _closure(module: str) -> list[str]:
    """Return a module and all that it imports, by their addresses below ``/page``."""
    found = [module]
    for name in found:
        text = file_of_page(name).read_text(encoding="utf-8")
        imported = (normpath(join(dirname(name), path)) for path in _IMPORT.findall(text))
        found += [other for other in dict.fromkeys(imported) if other not in found]
    return found
