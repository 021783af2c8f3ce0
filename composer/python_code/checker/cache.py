"""Keeps the problems that the type checker found in a set of files, by their content.

A project is checked far more often than its Python changes. The folder belongs to the user alone;
whatever goes wrong with it, the checker runs instead.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from composer.base.regular_files import read_regular
from composer.base.source import Span
from composer.python_code.checker.file_sets import FileSet
from composer.python_code.problems import Family, Problem

try:
    from _blake2 import blake2b  # hashlib also loads OpenSSL, which takes 3 ms of each start
except ImportError:
    from hashlib import blake2b

_MAXIMUM_ENTRIES = 500
_MAXIMUM_BYTES = 4_000_000


def entry_of(state: Iterable[str]) -> Path:
    """Return the file that keeps the problems of files; ``state`` is all that they depend on."""
    home = os.environ.get("XDG_CACHE_HOME", "")
    folder = Path(home) if Path(home).is_absolute() else _home() / ".cache"
    digest = blake2b(digest_size=32)
    for part in state:
        digest.update(part.encode(errors="surrogatepass") + b"\0")
    return folder / "ros2-composer" / "checks" / f"{digest.hexdigest()}.json"


def read_entry(entry: Path, files: FileSet) -> list[tuple[str, Problem]] | None:
    """Return the problems that were kept, each with the name of its file, or None."""
    try:
        if entry.stat(follow_symlinks=False).st_uid != os.geteuid():
            return None
        return [
            (name, Problem(Family[family], message, Span(files.files[name].text, *place), *others))
            for name, family, message, place, *others in json.loads(
                read_regular(entry, _MAXIMUM_BYTES)
            )
        ]
    except (OSError, ValueError, TypeError, KeyError, RecursionError):
        return None


def keep_entry(entry: Path, problems: Iterable[tuple[str, Problem]]) -> None:
    """Keep problems, each with the name of its file; the oldest entries make room."""
    kept = [
        (
            name,
            problem.family.name,
            problem.message,
            (problem.span.line, problem.span.column, problem.span.length),
            problem.hint,
            problem.is_certain,
        )
        for name, problem in problems
    ]
    with suppress(OSError):
        entry.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        _remove_oldest(entry.parent)
        written = entry.with_suffix(f".{os.getpid()}")
        written.write_text(json.dumps(kept), encoding="utf-8")
        written.replace(entry)


def _home() -> Path:
    try:
        return Path.home()
    except RuntimeError:  # in a container, users may be missing in /etc/passwd
        import tempfile  # noqa: PLC0415 - rare, and slow to import

        return Path(tempfile.gettempdir())


def _remove_oldest(folder: Path) -> None:
    entries = [*folder.iterdir()]
    if len(entries) >= _MAXIMUM_ENTRIES:
        for path in sorted(entries, key=lambda path: path.stat().st_mtime)[: len(entries) // 2]:
            path.unlink(missing_ok=True)
