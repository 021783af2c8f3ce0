"""Keeps what the checker said about a set of files, by their content.

A project is checked far more often than its Python changes. The folder belongs to the user alone;
whatever goes wrong with it, the checker runs instead.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterable, Mapping
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Any

_MAXIMUM_ENTRIES = 500
_MAXIMUM_BYTES = 4_000_000


def entry_of(files: Mapping[str, str], options: Iterable[str]) -> Path:
    """Return the file that keeps what the checker says about files, with the given options."""
    home = os.environ.get("XDG_CACHE_HOME", "")
    folder = Path(home) if Path(home).is_absolute() else _home() / ".cache"
    digest = sha256()
    for part in (*options, *(text for name in sorted(files) for text in (name, files[name]))):
        digest.update(part.encode(errors="surrogatepass") + b"\0")
    return folder / "ros2-composer" / "checks" / f"{digest.hexdigest()}.json"


def read_entry(entry: Path) -> list[dict[str, Any]] | None:
    """Return what was kept, or None."""
    try:
        status = entry.stat(follow_symlinks=False)
        if status.st_uid != os.geteuid() or status.st_size > _MAXIMUM_BYTES:
            return None
        kept = json.loads(entry.read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
    is_list = isinstance(kept, list) and all(isinstance(item, dict) for item in kept)
    return kept if is_list else None


def keep_entry(entry: Path, found: list[dict[str, Any]]) -> None:
    """Keep what the checker said; the oldest entries make room."""
    with suppress(OSError):
        entry.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        _remove_oldest(entry.parent)
        written = entry.with_suffix(f".{os.getpid()}")
        written.write_text(json.dumps(found), encoding="utf-8")
        written.replace(entry)


def _home() -> Path:
    try:
        return Path.home()
    except RuntimeError:  # in a container, users may be missing in /etc/passwd
        return Path(tempfile.gettempdir())


def _remove_oldest(folder: Path) -> None:
    entries = [*folder.iterdir()]
    if len(entries) >= _MAXIMUM_ENTRIES:
        for path in sorted(entries, key=lambda path: path.stat().st_mtime)[: len(entries) // 2]:
            path.unlink(missing_ok=True)
