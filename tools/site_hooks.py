"""MkDocs hooks: put pages from outside docs/ on the site, and make the links of all pages fit.

The files stay where GitHub readers expect them, and no copy of them can go stale.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
#: Files of the repository that are pages or downloads of the site, at the same path.
EXTRA = (
    "README.md",
    "ARCHITECTURE.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "SECURITY.md",
    "LICENSE",
    "benchmarks/README.md",
)
_LINK = re.compile(r"(?<=\]\()([^)\s#:]+)(?=[)#])")


def on_files(files: Files, *, config: Any) -> Files:
    """Add the extra files."""
    for path in EXTRA:
        files.append(File.generated(config, path, abs_src_path=str(ROOT / path)))
    return files


def on_page_markdown(markdown: str, *, page: Any, **_: Any) -> str:
    """Translate links that are relative to the repository into links relative to the site."""
    path = page.file.src_uri
    here = posixpath.dirname(path if path in EXTRA else f"docs/{path}")

    def translated(match: re.Match[str]) -> str:
        target = posixpath.normpath(posixpath.join(here, match[1]))
        on_site = target.removeprefix("docs/")
        return posixpath.relpath(on_site, posixpath.dirname(path) or ".")

    return _LINK.sub(translated, markdown)
