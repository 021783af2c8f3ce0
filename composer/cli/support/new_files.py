"""Files that commands write: whole or not at all, and not over others by accident."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from composer.cli.support.errors import CommandError
from composer.cli.support.terminal import say, write_raw


def write_output(text: str, output: Path | None, *, replace: bool | None = None) -> None:
    """Write to stdout, or to a file and its folder, and say so. Raises CommandError."""
    if output is None:
        write_raw(text)
    else:
        write_and_say(output.parent, {output.name: text}, replace=replace)


def write_and_say(
    root: Path, files: Mapping[str, str | bytes], *, replace: bool | None = None
) -> None:
    """Write files below ``root``, all or none, and say which. Raises CommandError."""
    written = write_files(root, files, replace=replace)
    for name in files:
        path = root / name
        say(f"wrote {path}" if path in written else f"{path} is up to date")


def write_files(
    root: Path, files: Mapping[str, str | bytes], *, replace: bool | None
) -> list[Path]:
    """Write files below ``root``, all or none; return those that were not there like that.

    With ``replace``, files that exist are replaced. None stands for a command that never does so.
    Raises CommandError.
    """
    encoded = _encoded(root, files)
    changed = {path: data for path, data in encoded.items() if not _has_content(path, data)}
    for path in () if replace else encoded if replace is None else changed:
        if path.is_file():
            hint = "choose another name, or remove it first"
            raise CommandError(
                f"'{path}' exists already", hint=hint if replace is None else "--force replaces it"
            )
    _write(changed, replace=bool(replace))
    return list(changed)


def write_file(path: Path, data: bytes) -> None:
    """Write a file in a folder that exists, in place of one there. Raises CommandError."""
    is_device = path.exists() and not path.is_file()  # such as /dev/stdout or a pipe
    if path.parent.is_dir() and not is_device:
        # Not resolve(), which raises RuntimeError for a link to itself: such a link is replaced.
        _write({Path(os.path.realpath(path)): data}, replace=True)
        return
    with _errors_of(path):
        path.write_bytes(data)


def _encoded(root: Path, files: Mapping[str, str | bytes]) -> dict[Path, bytes]:
    """Return the files with their paths, all of them below ``root``. Raises CommandError."""
    folder = Path(os.path.realpath(root))
    encoded: dict[Path, bytes] = {}
    for name, content in files.items():
        path = root / name
        parent = Path(os.path.realpath(path.parent))  # links lead out of a folder as well
        if not parent.is_relative_to(folder) or path.name in ("", ".."):
            raise CommandError(f"'{name}' is not in the folder '{root}'")
        encoded[path] = content.encode() if isinstance(content, str) else content
    return encoded


def _has_content(path: Path, data: bytes) -> bool:
    try:
        return path.is_file() and path.read_bytes() == data
    except OSError:
        return False


def _write(files: Mapping[Path, bytes], *, replace: bool) -> None:
    """Write files and their folders, all or none. Raises CommandError."""
    for path in files:
        with _errors_of(path):
            if path.exists() and not path.is_file():  # a folder, or a device such as /dev/null
                raise CommandError(f"cannot write '{path}': it is not a regular file")
            if not replace and path.exists():
                raise FileExistsError
    # At the end, first the files of before are restored, if it has failed.
    with ExitStack() as folders, ExitStack() as temporaries, ExitStack() as placed:
        new: dict[Path, Path] = {}
        for path, data in files.items():
            with _errors_of(path):
                _make_folder(path.parent, folders)
                new[path] = _temporary(path, temporaries)
                new[path].write_bytes(data)
                new[path].chmod(0o666 & ~_umask())
        # Nothing has changed until here: what can fail for lack of space has been done.
        old = {path: _copied(path, temporaries) for path in files if os.path.lexists(path)}
        for path in files:
            with _errors_of(path):
                if replace:
                    new[path].replace(path)
                else:
                    os.link(new[path], path)  # unlike a rename, does not replace a file
            if path in old:
                placed.callback(old[path].replace, path)
            else:
                placed.callback(path.unlink, missing_ok=True)
        placed.pop_all()
        folders.pop_all()


def _make_folder(folder: Path, folders: ExitStack) -> None:
    """Make a folder and its parents, which are removed at the end. Raises OSError."""
    missing = [item for item in (folder, *folder.parents) if not item.exists()]
    for item in reversed(missing):
        with suppress(FileExistsError):
            item.mkdir()
            folders.callback(_remove_folder, item)


def _remove_folder(folder: Path) -> None:
    with suppress(OSError):  # another program has written to it
        folder.rmdir()


def _temporary(path: Path, temporaries: ExitStack) -> Path:
    """Return a new empty file next to ``path``, which is removed at the end. Raises OSError."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    os.close(handle)
    temporaries.callback(Path(name).unlink, missing_ok=True)
    return Path(name)


def _copied(path: Path, temporaries: ExitStack) -> Path:
    """Return a copy of a file. Raises CommandError."""
    with _errors_of(path):
        copy = _temporary(path, temporaries)
        copy.unlink()
        shutil.copy2(path, copy, follow_symlinks=False)
        return copy


@contextmanager
def _errors_of(path: Path) -> Iterator[None]:
    """Context manager: an OSError in the block becomes a CommandError about ``path``."""
    try:
        yield
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
