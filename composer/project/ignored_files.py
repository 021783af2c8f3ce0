"""Which files git and docker ignore: the patterns of ``.gitignore`` and ``.dockerignore``.

See git-scm.com/docs/gitignore and github.com/moby/patternmatcher.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path

from composer.base.fast_dataclass import dataclass
from composer.base.regular_files import read_regular

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
