"""Report words and phrases that banned_words.txt lists, in the files that git tracks."""

from __future__ import annotations

import argparse
import fnmatch
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
WORDS = Path(__file__).with_name("banned_words.txt")

#: Tracked files that are checked, as git pathspecs.
SCOPE = (
    *("composer", "docs", "schemas/parts", "systems", "nodes", "interfaces"),
    *(
        "tests",
        "benchmarks",
        "tools",
        "*.md",
        "*.toml",
        "*.yml",
        ".pre-commit-hooks.yaml",
        "Makefile",
    ),
)
EXCLUDED = (
    "*.json",
    "*.png",
    "*.svg",
    "*.xml",
    "tests/corpus/code/*",
    "*node_modules*",
    "LICENSE",
    "tools/banned_words.txt",
)

#: Put between the words of CamelCase before the search.
SEAM = "\0"
#: What a space of a pattern matches: spaces, underscores, or a line break in prose or a comment.
GAP = r"(?:[ \t_\0]+|[ \t]*\n[ \t]*(?:[#>*]|//|\#:)?[ \t]*)"


@dataclass(frozen=True)
class Ban:
    """A pattern, what to write instead, and the globs of files that may contain it."""

    pattern: re.Pattern[str]
    suggestion: str
    allowed: tuple[str, ...]


@dataclass(frozen=True)
class Use:
    """A banned word at its place in a file; line and column count from 1."""

    path: str
    line: int
    column: int
    word: str
    suggestion: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}:{self.column}: {self.word!r}: use {self.suggestion}"


def read_bans(text: str) -> list[Ban]:
    """Return the bans of a word list."""
    lines = (line.strip() for line in text.splitlines())
    return [_ban(line) for line in lines if line and not line.startswith("#")]


def _ban(line: str) -> Ban:
    pattern, arrow, rest = line.partition(" -> ")
    if not arrow:
        raise ValueError(f"expected 'pattern -> suggestion', not {line!r}")
    suggestion, _, allowed = rest.partition(" | ")
    spaced = pattern.replace(" ", GAP)
    # check() looks at the letter before: a lookbehind here would make the search much slower.
    return Ban(re.compile(f"(?:{spaced})(?![a-z])"), suggestion.strip(), tuple(allowed.split()))


def check(path: str, text: str, bans: Iterable[Ban]) -> list[Use]:
    """Return the uses of banned words in the text of a file, by line and column."""
    seamed = re.sub("(?<=[a-z])(?=[A-Z])", SEAM, text).lower()
    uses: list[Use] = []
    for ban in bans:
        if any(fnmatch.fnmatch(path, glob) for glob in ban.allowed):
            continue
        for match in ban.pattern.finditer(seamed):
            start = match.start()
            if start and seamed[start - 1].isalpha():
                continue
            line = seamed.count("\n", 0, start) + 1
            before = seamed[seamed.rfind("\n", 0, start) + 1 : start]
            column = len(before.replace(SEAM, "")) + 1
            word = " ".join(match.group().replace(SEAM, "").split())
            uses.append(Use(path, line, column, word, ban.suggestion))
    return sorted(uses, key=lambda use: (use.line, use.column))


def tracked_files(root: Path, paths: Iterable[str] = ()) -> list[str]:
    """Return the tracked files in scope, only those below `paths` if any are given."""
    listed = _git_ls_files(root, *SCOPE, *(f":(exclude,glob)**/{glob}" for glob in EXCLUDED))
    if chosen := list(paths):
        below = set(_git_ls_files(root, *chosen))
        return [name for name in listed if name in below]
    return listed


def _git_ls_files(root: Path, *pathspecs: str) -> list[str]:
    done = subprocess.run(
        ["git", "ls-files", "-z", "--", *pathspecs],
        cwd=root,
        check=True,
        capture_output=True,
        text=True,
    )
    return [name for name in done.stdout.split("\0") if name and (root / name).is_file()]


def check_files(root: Path, names: Iterable[str], bans: list[Ban]) -> list[Use]:
    """Return the uses of banned words in files below `root`, by file, line and column."""
    uses: list[Use] = []
    for name in names:
        uses += check(name, (root / name).read_text(encoding="utf-8", errors="replace"), bans)
    return uses


def _print_counts(uses: list[Use]) -> None:
    folders = Counter(str(Path(use.path).parent) for use in uses)
    words = Counter(use.word.lower() for use in uses)
    for folder, count in sorted(folders.items()):
        print(f"{count:6}  {folder}")
    print(f"{len(uses):6}  in total:", ", ".join(f"{w} {n}" for w, n in words.most_common(20)))


def main(arguments: list[str] | None = None) -> int:
    """Print the banned words that are in use and return 1 if there are any."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("paths", nargs="*", help="files or folders (default: all tracked files)")
    parser.add_argument("--count", action="store_true", help="print one number per folder")
    options = parser.parse_args(arguments)
    paths = [str(Path(path).resolve().relative_to(ROOT)) for path in options.paths]
    uses = check_files(ROOT, tracked_files(ROOT, paths), read_bans(WORDS.read_text("utf-8")))
    if options.count:
        _print_counts(uses)
    else:
        for use in uses:
            print(use)
    return 1 if uses else 0


if __name__ == "__main__":
    sys.exit(main())
