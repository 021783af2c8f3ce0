"""The files that arguments mean: a system by path or by the name of an example, YAML in folders."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from composer.cli.failure import UsageFailure
from composer.diagnostics import nearest
from composer.resources import systems_folder

#: The first keys by which a file says that it is for the composer.
_MARKER = re.compile(rb"^(system|node)[ \t]*:", re.MULTILINE)
_SUFFIXES = (".yaml", ".yml")


@dataclass(frozen=True, slots=True)
class Found:
    """The YAML files under some paths; ``ignored`` are those in folders that are something else."""

    files: tuple[Path, ...]
    ignored: tuple[Path, ...]


def system_file(text: str) -> Path:
    """Return the file that ``text`` means: a path, else the name of an example system.

    Raises UsageFailure.
    """
    path = Path(text)
    if path.is_file():
        return path
    if path.is_dir():
        raise UsageFailure(f"'{text}' is a folder, not a system file")
    examples = example_systems()
    if text in examples:
        return examples[text]
    close = nearest(text, examples)
    listed = "example systems: " + ", ".join(sorted(examples))
    raise UsageFailure(
        f"there is no file '{text}' and no example system of that name",
        hint=listed if close is None else f"did you mean '{close}'?\n{listed}",
    )


def example_systems() -> dict[str, Path]:
    """Return the systems that come with the composer, by name."""
    return {path.stem: path for path in sorted(systems_folder().glob("*.yaml"))}


def yaml_files(texts: list[Path]) -> Found:
    """Return the files that are named, and in folders those that are for the composer.

    Raises UsageFailure for a path that does not exist.
    """
    files: dict[Path, None] = {}
    ignored: dict[Path, None] = {}
    for path in texts:
        if path.is_dir():
            for file in _in_folder(path):
                (files if _MARKER.search(file.read_bytes()) else ignored)[file] = None
        elif path.exists():
            files[path] = None
        else:
            raise UsageFailure(f"there is no file or folder '{path}'")
    return Found(tuple(files), tuple(ignored))


def _in_folder(folder: Path) -> Iterator[Path]:
    for path in sorted(folder.rglob("*")):
        hidden = any(part.startswith(".") for part in path.relative_to(folder).parts)
        if path.suffix in _SUFFIXES and path.is_file() and not hidden:
            yield path
