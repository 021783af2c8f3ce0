"""Files that commands write and that must not replace others."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
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


def write_new_file(path: Path, text: str) -> None:
    """Write a new file, whole or not at all, and its folder. Raises CommandError."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        temporary = Path(name)
        try:
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                file.write(text)
            temporary.chmod(0o666 & ~_umask())
            os.link(temporary, path)  # unlike rename(), does not replace a file
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
