"""Results that are kept on disk, by the content of all that they depend on.

The folder belongs to the user alone. Whatever goes wrong with it, the result is computed again.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from composer.base.regular_files import read_regular

try:
    from _blake2 import blake2b  # hashlib also loads OpenSSL, which takes 3 ms of each start
except ImportError:
    from hashlib import blake2b

#: Results that are kept of one kind, and the most bytes of one.
_MAXIMUM_ENTRIES = 500
_MAXIMUM_BYTES = 1_000_000
_DIGEST_BYTES = 32


class KeptResult:
    """A result of one kind; ``data`` is None if it is not kept, or damaged."""

    def __init__(self, kind: str, state: Iterable[str]) -> None:
        """Look for the result that depends on ``state``."""
        digest = blake2b(digest_size=_DIGEST_BYTES)
        for part in state:
            digest.update(part.encode(errors="surrogatepass") + b"\0")
        self._path = _cache_folder() / "ros2-composer" / kind / digest.hexdigest()
        self.data = self._read()

    def keep(self, data: bytes) -> None:
        """Keep a result, unless it is too large; the oldest ones make room."""
        if len(data) > _MAXIMUM_BYTES:
            return
        with suppress(OSError):
            folder = self._path.parent
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            _remove_oldest(folder)
            written = self._path.with_suffix(f".{os.getpid()}")
            written.write_bytes(_checksum(data) + data)
            written.replace(self._path)

    def _read(self) -> bytes | None:
        with suppress(OSError, ValueError):
            if self._path.stat(follow_symlinks=False).st_uid == os.geteuid():
                content = read_regular(self._path, _DIGEST_BYTES + _MAXIMUM_BYTES)
                data = content[_DIGEST_BYTES:]
                return data if content == _checksum(data) + data else None
        return None


def _checksum(data: bytes) -> bytes:
    return blake2b(data, digest_size=_DIGEST_BYTES).digest()


def _cache_folder() -> Path:
    chosen = Path(os.environ.get("XDG_CACHE_HOME", ""))
    if chosen.is_absolute():
        return chosen
    try:
        return Path.home() / ".cache"
    except RuntimeError:  # in a container, users may be missing in /etc/passwd
        return Path(tempfile.gettempdir())


def _remove_oldest(folder: Path) -> None:
    entries = [*folder.iterdir()]
    if len(entries) >= _MAXIMUM_ENTRIES:
        for path in sorted(entries, key=lambda path: path.stat().st_mtime)[: len(entries) // 2]:
            path.unlink(missing_ok=True)
