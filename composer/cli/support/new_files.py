"""Files that commands write: whole or not at all, and not over others by accident."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

from composer.cli.support.errors import CommandError


def write_new_files(root: Path, files: Mapping[str, str]) -> None:
    """Write new files below ``root``, all or none, and their folders. Raises CommandError."""
    for path in files:
        if (root / path).exists():
            raise CommandError(
                f"'{root / path}' exists already", hint="choose another name, or remove it first"
            )
    written: list[Path] = []
    try:
        for path, text in files.items():
            write_new_file(root / path, text)
            written.append(root / path)
    except CommandError:
        for file in written:
            file.unlink(missing_ok=True)
        raise


def write_exports(root: Path, files: Mapping[str, str], *, replace: bool) -> list[Path]:
    """Write files below ``root``, and return those that were not there with the same text.

    With ``replace``, each file replaces one that exists. Otherwise, all or none of them are
    written. Raises CommandError.
    """
    changed = {path: text for path, text in files.items() if not _has_text(root / path, text)}
    if not replace:
        try:
            write_new_files(root, changed)
        except CommandError as error:
            raise CommandError(error.message, hint="--force replaces it") from error
    else:
        for path, text in changed.items():
            _write(root / path, text.encode(), os.replace)
    return [root / path for path in changed]


def _has_text(path: Path, text: str) -> bool:
    try:
        return path.read_text(encoding="utf-8") == text
    except (OSError, ValueError):
        return False


def write_new_file(path: Path, text: str) -> None:
    """Write a new file, whole or not at all, and its folder. Raises CommandError."""
    _write(path, text.encode(), os.link)  # unlike rename(), does not replace a file


def write_file(path: Path, data: bytes) -> None:
    """Write a file in a folder that exists, in place of one there. Raises CommandError."""
    is_device = path.exists() and not path.is_file()  # such as /dev/stdout or a pipe
    if path.parent.is_dir() and not is_device:
        _write(path.resolve(), data, os.replace)
        return
    try:
        path.write_bytes(data)
    except OSError as error:
        raise CommandError(f"cannot write '{path}': {error.strerror}") from error


def _write(path: Path, data: bytes, place: Callable[[Path, Path], None]) -> None:
    """Write a file, whole or not at all; ``place`` gives the temporary file its name."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        temporary = Path(name)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(data)
            temporary.chmod(0o666 & ~_umask())
            place(temporary, path)
        finally:
            with suppress(FileNotFoundError):
                temporary.unlink()
    except FileExistsError:
        raise CommandError(
            f"'{path}' exists already", hint="choose another name, or remove it first"
        ) from None
    except OSError as error:
        raise CommandError(f"cannot write '{path}': {error.strerror}") from error


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
