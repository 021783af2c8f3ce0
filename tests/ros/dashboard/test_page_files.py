"""The page names the modules of a view, so that the browser loads them at once."""

from __future__ import annotations

import re

import pytest

from composer.dashboard.web.app import VIEWS, file_of_page, index_of

_LINK = re.compile(r'<link rel="modulepreload" href="/page/([^"]+)">')


@pytest.mark.parametrize("view", ["", *VIEWS])
def test_every_view_names_its_modules(view: str) -> None:
    modules = _LINK.findall(index_of(view).decode())
    assert len(set(modules)) == len(modules)
    assert {"main.js", "dom.js", "connection.js"} <= set(modules)
    assert all(file_of_page(name).is_file() for name in modules)
    assert ("graph/viewport.js" in modules) == (view in ("", "graph"))
