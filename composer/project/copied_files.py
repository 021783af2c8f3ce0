"""Which files of a project are copied to other computers and into images.

Secrets stay here, and so does what git and docker ignore. rsync and docker copy everything else:
both get the files that stay as patterns. An image may be built later, so docker also gets patterns
for files that do not exist yet.
"""

from __future__ import annotations

import os
import posixpath
import re
import stat
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import TypeAlias

from pathspec import GitIgnoreSpec, PathSpec

from composer.base.fast_dataclass import dataclass
from composer.base.regular_files import open_regular, read_regular

#: In a workspace: it holds a copy of a project, which may be replaced.
MARK = ".compose-sync"
#: What each computer makes for itself, and repositories; as patterns of git.
_NOT_COPIED = (
    *(".git", ".venv", "venv", "__pycache__", "node_modules"),
    *("/build", "/install", "/log", "/logs", f"/{MARK}"),
)
_SECRET_NAMES = (
    *(".env", ".env.*", "!.env.example", "!.env.sample", "!.env.template"),
    *(".netrc", "id_rsa", "id_dsa", "id_ecdsa", "id_ed25519", "*.ppk"),
)
#: Of a file that only its owner may read. Names of source files end otherwise.
_KEY_NAME = re.compile(
    r"id_\w+|(.*[._-])?(keys?|secrets?|credentials?|tokens?|passwords?)(\.json|\.txt)?"
    r"|.*\.(pem|der|p12|pfx|jks|keystore|kdbx|gpg|asc)",
    re.IGNORECASE | re.DOTALL,
)
_KEY_CONTENT = re.compile(
    rb"^(-{4,5} ?BEGIN [A-Z0-9 ]*PRIVATE KEY|PuTTY-User-Key-File|AGE-SECRET-KEY-)", re.MULTILINE
)
_MAX_PATTERN_BYTES = 1_000_000
_HEAD_BYTES = 16_384  # text may precede a key
_OTHER_USERS = 0o077
_PRIVATE = "the private key of a host"
#: The reason for files that no computer needs from another one.
_MADE_THERE = "made on each computer"


@dataclass(frozen=True, slots=True)
class CopiedFiles:
    """The files of a project, relative to its root, that are copied, and those that stay here.

    ``staying`` has the reason for each file or folder.
    """

    copied: tuple[str, ...]
    staying: tuple[tuple[str, str], ...]

    @property
    def rsync_patterns(self) -> tuple[str, ...]:
        """The patterns of files that rsync does not copy, nor delete there: the first one decides.

        The general ones also protect what only the other computer has, such as its ``.venv``.
        """
        general = (re.sub("^!", "+ ", name) for name in reversed((*_NOT_COPIED, *_SECRET_NAMES)))
        return (*(pattern_of(path) for path, _ in self.staying), *general)

    @property
    def docker_patterns(self) -> tuple[str, ...]:
        """The patterns of files that are not in an image, without what is made there."""
        return tuple(pattern_of(path) for path, why in self.staying if why != _MADE_THERE)

    @property
    def reasons(self) -> tuple[str, ...]:
        """The files that stay here with the reasons, without what each computer makes."""
        return tuple(f"{path} ({why})" for path, why in self.staying if why != _MADE_THERE)


def pattern_of(path: str) -> str:
    """Return a pattern that matches a file below a root, for rsync and for docker.

    ``*`` stands for characters that the two read differently.
    """
    text = re.sub(r"[*?\[]", r"\\\g<0>", path.replace("\\", "\n"))
    text = "".join(character if character.isprintable() else "*" for character in text)
    return "/" + re.sub(" $", "*", text)


def docker_patterns(root: Path) -> Iterator[str]:
    """Yield the patterns for docker that do not depend on the files that exist now.

    Docker reads the patterns of one file only, so those of the project's own are among them.
    """
    yield from _lines(root / ".dockerignore")
    for name in (*_NOT_COPIED, *_SECRET_NAMES):
        yield re.sub(r"^(!?)(?=[^!/])", r"\1**/", name)


def copied_files(root: Path, private: Iterable[Path] = ()) -> CopiedFiles:
    """Return which files below ``root`` are copied. ``private`` are files that stay here.

    Private files need not exist yet. Symbolic links are copied as links; devices, pipes and sockets
    not at all.
    """
    root = Path(os.path.realpath(root))
    keys = [Path(os.path.realpath(path)) for path in private]
    checks = _Checks(root, keys)
    copied: list[str] = []
    staying: dict[str, str] = {}
    folders = [(root, _ignores_above(root))]
    while folders:
        folder, outer = folders.pop()
        ignores = (*outer, (folder, GitIgnoreSpec.from_lines(_lines(folder / ".gitignore"))))
        for entry in _entries(folder):
            path = Path(entry.path).relative_to(root).as_posix()
            reason = checks.reason(entry, path, ignores)
            if reason is not None:
                staying[path] = reason
            elif entry.is_dir(follow_symlinks=False):
                folders.append((Path(entry.path), ignores))
            elif entry.is_file(follow_symlinks=False) or entry.is_symlink():
                copied.append(path)
    missing = (path.relative_to(root).as_posix() for path in keys if path.is_relative_to(root))
    staying |= dict.fromkeys(missing, _PRIVATE)
    return CopiedFiles(tuple(sorted(copied)), tuple(sorted(staying.items())))


#: Folders with the patterns of their .gitignore, the outermost first.
_Ignores: TypeAlias = tuple[tuple[Path, GitIgnoreSpec], ...]


class _Checks:
    """Says why a file below ``root`` stays here."""

    def __init__(self, root: Path, keys: Iterable[Path]) -> None:
        lines = _lines(root / ".dockerignore")
        # For docker, unlike git, the last pattern decides, also below an excluded folder.
        self._docker = PathSpec(GitIgnoreSpec.from_lines(map(_from_docker, lines)).patterns)
        self._docker_includes = any(line.startswith("!") for line in lines)
        self._not_copied = GitIgnoreSpec.from_lines(_NOT_COPIED)
        self._secret = GitIgnoreSpec.from_lines(_SECRET_NAMES)
        self._keys = {(found.st_dev, found.st_ino) for found in filter(None, map(_status, keys))}

    def reason(self, entry: os.DirEntry[str], path: str, ignores: _Ignores) -> str | None:
        """Return why a file or folder stays here; ``path`` is relative to the root."""
        is_folder = entry.is_dir(follow_symlinks=False)
        name = f"{path}/" if is_folder else path
        if self._not_copied.match_file(name):
            return _MADE_THERE
        if _is_ignored(Path(entry.path), ignores, is_folder=is_folder):
            return "ignored by .gitignore"
        if self._docker.match_file(name) and not (is_folder and self._docker_includes):
            return "ignored by .dockerignore"
        if self._secret.match_file(name):
            return "a secret, by its name"
        return None if is_folder else self._secret_reason(Path(entry.path))

    def _secret_reason(self, path: Path) -> str | None:
        """Return why a file is a secret, by its content and permissions."""
        status = _status(path, follow=False)
        if status is None or not stat.S_ISREG(status.st_mode):
            return None
        if (status.st_dev, status.st_ino) in self._keys:
            return _PRIVATE
        if _KEY_CONTENT.search(_head(path)):
            return "a private key"
        if not status.st_mode & _OTHER_USERS and _KEY_NAME.fullmatch(path.name):
            return "a secret: only you may read it"
        return None


def _ignores_above(root: Path) -> _Ignores:
    """Return the patterns of git that apply to ``root``: those of folders of its repository."""
    folders = (root, *root.parents)
    repository = next((path for path in folders if (path / ".git").exists()), root)
    above = [path for path in root.parents if path.is_relative_to(repository)]
    return tuple(
        (path, GitIgnoreSpec.from_lines(_lines(path / ".gitignore"))) for path in reversed(above)
    )


def _is_ignored(path: Path, ignores: _Ignores, *, is_folder: bool) -> bool:
    """Return whether git ignores a file: the innermost .gitignore that mentions it decides."""
    for folder, patterns in reversed(ignores):
        name = path.relative_to(folder).as_posix()
        decision = patterns.check_file(f"{name}/" if is_folder else name).include
        if decision is not None:
            return decision
    return False


def _from_docker(line: str) -> str:
    """Return a pattern of docker as one of git: docker's begin at the root."""
    inverted, pattern = ("!", line[1:].strip()) if line.startswith("!") else ("", line)
    return f"{inverted}/{posixpath.normpath(pattern).lstrip('/')}"


def _lines(path: Path) -> list[str]:
    """Return the patterns of a file; none if it is not there."""
    try:
        data = read_regular(path, _MAX_PATTERN_BYTES)
    except OSError:
        return []
    text = data.decode(errors="replace").removeprefix("\ufeff")
    lines = [line.strip() for line in text.splitlines()]
    return [line for line in lines if line and not line.startswith("#")]


def _entries(folder: Path) -> list[os.DirEntry[str]]:
    """Return what is in a folder; nothing if it cannot be read."""
    with suppress(OSError), os.scandir(folder) as entries:
        return sorted(entries, key=lambda entry: entry.name)
    return []


def _status(path: Path, *, follow: bool = True) -> os.stat_result | None:
    with suppress(OSError):
        return path.stat(follow_symlinks=follow)
    return None


def _head(path: Path) -> bytes:
    with suppress(OSError), open_regular(path) as file:
        return file.read(_HEAD_BYTES)
    return b""
