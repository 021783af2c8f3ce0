"""Which files of a project are copied to other computers and into images.

Secrets stay here, and so does what git and docker ignore. rsync and docker copy everything else:
both get the files that stay as patterns. An image may be built later, so docker also gets patterns
for files that do not exist yet. The patterns are those of git-scm.com/docs/gitignore and
github.com/moby/patternmatcher.
"""

from __future__ import annotations

import os
import posixpath
import re
import stat
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TypeAlias

from composer.base.fast_dataclass import dataclass
from composer.base.files import open_regular, read_regular

_MAX_PATTERN_BYTES = 1_000_000
_GIT_WORD = re.compile(
    r"(?P<folders>((?<![^/])\*\*/)+)|(?P<rest>(?<![^/])\*\*$)|(?P<part>\*+)|(?P<one>\?)"
    r"|(?P<set>\[[!^]?]?(\[:\w+:]|\\.|[^]\\])*])|\\?(?P<letter>.)",
    re.DOTALL,
)
_DOCKER_WORD = re.compile(
    r"(?P<rest>(\*\*/?)+$)|(?P<folders>(\*\*/?)+)|(?P<part>\*)|(?P<one>\?)"
    r"|(?P<set>\[\^?[^]]+])|\\?(?P<letter>.)",
    re.DOTALL,
)
_EXPRESSIONS = {"folders": "(?:.*/)?", "rest": ".*", "part": "[^/]*", "one": "[^/]"}
_CLASSES = {"alpha": "a-zA-Z", "digit": "0-9", "alnum": "a-zA-Z0-9", "space": r"\s"}
_CLASSES |= {"upper": "A-Z", "lower": "a-z", "xdigit": "0-9a-fA-F"}

#: In a workspace: it holds a copy of a project, which may be replaced.
MARK = ".compose-sync"
#: What each computer makes for itself, and repositories; as patterns of git.
_NOT_COPIED = (
    *(".git", ".venv", "venv", "__pycache__", "node_modules"),
    *("/build", "/install", "/log", "/logs", f"/{MARK}"),
)
_SECRET_NAMES = (
    *(".env", ".env.*", "!.env.example", "!.env.sample", "!.env.template"),
    *("id_rsa", "id_dsa", "id_ecdsa", "id_ed25519", "id_ecdsa_sk", "id_ed25519_sk", "*.ppk"),
    *(".netrc", ".pgpass", ".pypirc", ".git-credentials", ".ssh", ".gnupg", ".aws"),
)
#: Of a file that only its owner may read. Names of source files end otherwise.
_KEY_NAME = re.compile(
    r"id_[\w-]+|.*(key|secret|credential|token|password|passwd|psk)s?(\.(txt|json|bak|old))?"
    r"|.*(secret|credential|token|password)s?\.(ya?ml|toml|ini|cfg|conf)"
    r"|.*\.(pem|der|key|p8|p12|pfx|jks|keystore|kdbx|gpg|asc|age|env|ovpn)",
    re.IGNORECASE | re.DOTALL,
)
_PRIVATE_KEY = rb"-{4,5} ?BEGIN [A-Z0-9 ]*PRIVATE KEY"
_KEY_CONTENT = re.compile(
    rb"^(\xef\xbb\xbf)?[ \t]*(%b|PuTTY-User-Key-File|AGE-SECRET-KEY-|PrivateKey ?=)" % _PRIVATE_KEY,
    re.MULTILINE,
)
#: In a file that only its owner may read, such as the JSON file of a service account.
_KEY_ANYWHERE = re.compile(_PRIVATE_KEY)
_HEAD_BYTES = 16_384  # text may precede a key
_OTHER_USERS = 0o077
_PRIVATE = "the private key of a host"
#: The reason for files that no computer needs from another one.
_MADE_THERE = "made on each computer"


@dataclass(frozen=True, slots=True)
class Pattern:
    """A pattern for paths below a folder; ``excludes`` is false if it begins with ``!``."""

    excludes: bool
    regex: re.Pattern[str]
    only_folders: bool = False

    def matches(self, path: str, *, is_folder: bool) -> bool:
        """Return whether the pattern matches a file or a folder, a path with ``/``."""
        return (is_folder or not self.only_folders) and self.regex.fullmatch(path) is not None


def decision(patterns: Sequence[Pattern], path: str, *, is_folder: bool) -> bool | None:
    """Return whether the last pattern that matches excludes a path; None if none matches."""
    matching = (p.excludes for p in reversed(patterns) if p.matches(path, is_folder=is_folder))
    return next(matching, None)


def git_patterns(lines: Iterable[str]) -> tuple[Pattern, ...]:
    """Return the patterns of lines. Git ignores those that are not valid.

    They match files and folders, but not what is in these folders.
    """
    patterns: list[Pattern] = []
    for line in lines:
        text = re.sub(r"(?<!\\) +$", "", line)
        name = text.removeprefix("!").removesuffix("/")
        if not name or text.startswith("#") or re.search(r"(?<!\\)(\\\\)*\\$", name):
            continue
        place = "" if "/" in name else "(?:.*/)?"
        with suppress(re.error):
            regex = re.compile(place + _regex(_GIT_WORD, name.removeprefix("/")), re.DOTALL)
            patterns.append(Pattern(not text.startswith("!"), regex, text.endswith("/")))
    return tuple(patterns)


def docker_patterns(lines: Iterable[str]) -> tuple[Pattern, ...]:
    """Return the patterns of lines. They match files, folders and what is in these folders.

    Docker refuses patterns that are not valid; here, they match nothing.
    """
    patterns: list[Pattern] = []
    for line in lines:
        text = posixpath.normpath(line.removeprefix("!").strip()).lstrip("/")
        # Docker compares the end of a path, in place of the folders before a name.
        is_ending = re.fullmatch(r"\*\*[^/*?\\[\]][^*?\\[\]]*", text)
        regex = ".*" + re.escape(text[2:]) if is_ending else _regex(_DOCKER_WORD, text)
        with suppress(re.error):
            whole = re.compile(f"(?:{regex})(?:/.*)?", re.DOTALL)
            patterns.append(Pattern(not line.startswith("!"), whole))
    return tuple(patterns)


def docker_lines(root: Path) -> list[str]:
    """Return the patterns of docker as they are written. It reads only the file in ``root``."""
    lines = (line.strip() for line in pattern_lines(root / ".dockerignore") if line[:1] != "#")
    return [line for line in lines if line.removeprefix("!").strip()]


def pattern_lines(path: Path) -> list[str]:
    """Return the lines of a file with patterns; none if it is not there."""
    try:
        data = read_regular(path, _MAX_PATTERN_BYTES)
    except OSError:
        return []
    text = data.removeprefix(b"\xef\xbb\xbf").decode(errors="surrogateescape")
    return [line.removesuffix("\r") for line in text.split("\n")]


def _regex(word: re.Pattern[str], text: str) -> str:
    return word.sub(_expression, text)


def _expression(word: re.Match[str]) -> str:
    """Return the regular expression for a word of a pattern."""
    kind = word.lastgroup or "letter"
    if kind == "letter":
        return re.escape(word["letter"])
    if kind != "set":
        return _EXPRESSIONS[kind]
    letters = re.sub(r"\[:(\w+):]", lambda name: _CLASSES.get(name[1], ""), word["set"][1:-1])
    negations = "!^" if word.re is _GIT_WORD else "^"
    begin = "^" if letters[0] in negations else ""
    escaped = re.sub(r"[][&|~^]", r"\\\g<0>", letters[len(begin) :])
    return f"(?!/)[{begin}{escaped}]"


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


def patterns_for_images(root: Path) -> Iterator[str]:
    """Yield the patterns for docker that do not depend on the files that exist now.

    Docker reads the patterns of one file only, so those of the project's own are among them.
    """
    yield from docker_lines(root)
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
    folders = [(root, _ignores_above(root), False)]
    while folders:
        folder, outer, is_closed = folders.pop()
        ignores = (*outer, (folder, _git_ignores(folder / ".gitignore")))
        for entry in _entries(folder):
            path = Path(entry.path).relative_to(root).as_posix()
            only_owner = is_closed or _only_owner_reads(entry)
            reason = checks.reason(entry, path, ignores, only_owner=only_owner)
            if reason is not None:
                staying[path] = reason
            elif entry.is_dir(follow_symlinks=False):
                folders.append((Path(entry.path), ignores, only_owner))
            elif entry.is_file(follow_symlinks=False) or entry.is_symlink():
                copied.append(path)
    missing = (path.relative_to(root).as_posix() for path in keys if path.is_relative_to(root))
    staying |= dict.fromkeys(missing, _PRIVATE)
    return CopiedFiles(tuple(sorted(copied)), tuple(sorted(staying.items())))


#: Folders with the patterns of their .gitignore, the outermost first.
_Ignores: TypeAlias = tuple[tuple[Path, tuple[Pattern, ...]], ...]


class _Checks:
    """Says why a file below ``root`` stays here."""

    def __init__(self, root: Path, keys: Iterable[Path]) -> None:
        self._docker = docker_patterns(docker_lines(root))
        self._docker_includes = not all(pattern.excludes for pattern in self._docker)
        self._not_copied = git_patterns(_NOT_COPIED)
        self._secret = git_patterns(_SECRET_NAMES)
        self._keys = {(found.st_dev, found.st_ino) for found in filter(None, map(_status, keys))}

    def reason(
        self, entry: os.DirEntry[str], path: str, ignores: _Ignores, *, only_owner: bool
    ) -> str | None:
        """Return why a file or folder stays here; ``path`` is relative to the root."""
        is_folder = entry.is_dir(follow_symlinks=False)
        if decision(self._not_copied, path, is_folder=is_folder):
            return _MADE_THERE
        if _is_ignored(Path(entry.path), ignores, is_folder=is_folder):
            return "ignored by .gitignore"
        # Other than git, docker includes files of excluded folders again.
        is_ignored = decision(self._docker, path, is_folder=is_folder)
        if is_ignored and not (is_folder and self._docker_includes):
            return "ignored by .dockerignore"
        if decision(self._secret, path, is_folder=is_folder):
            return "a secret, by its name"
        return None if is_folder else self._secret_reason(Path(entry.path), only_owner=only_owner)

    def _secret_reason(self, path: Path, *, only_owner: bool) -> str | None:
        """Return why a file is a secret, by its content and permissions."""
        status = _status(path, follow=False)
        if status is None or not stat.S_ISREG(status.st_mode):
            return None
        if (status.st_dev, status.st_ino) in self._keys:
            return _PRIVATE
        head = _head(path)
        if _KEY_CONTENT.search(head):
            return "a private key"
        if only_owner and (_KEY_NAME.fullmatch(path.name) or _KEY_ANYWHERE.search(head)):
            return "a secret: only you may read it"
        return None


def _ignores_above(root: Path) -> _Ignores:
    """Return the patterns of git that apply to ``root``, from its repository and from folders."""
    folders = (root, *root.parents)
    repository = next((path for path in folders if (path / ".git").exists()), root)
    above = [path for path in root.parents if path.is_relative_to(repository)]
    return (
        (repository, _git_ignores(repository / ".git" / "info" / "exclude")),
        *((path, _git_ignores(path / ".gitignore")) for path in reversed(above)),
    )


def _git_ignores(path: Path) -> tuple[Pattern, ...]:
    return git_patterns(pattern_lines(path))


def _is_ignored(path: Path, ignores: _Ignores, *, is_folder: bool) -> bool:
    """Return whether git ignores a file: the innermost .gitignore that mentions it decides."""
    for folder, patterns in reversed(ignores):
        name = path.relative_to(folder).as_posix()
        is_ignored = decision(patterns, name, is_folder=is_folder)
        if is_ignored is not None:
            return is_ignored
    return False


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


def _only_owner_reads(entry: os.DirEntry[str]) -> bool:
    with suppress(OSError):
        return not entry.stat(follow_symlinks=False).st_mode & _OTHER_USERS
    return False
