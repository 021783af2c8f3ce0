"""The system that an argument means: by path, or by the name of an example."""

from __future__ import annotations

from pathlib import Path

from composer.cli.support.failure import UsageFailure
from composer.diagnostics import nearest
from composer.resources import systems_folder

#: Of folders and of files that may be meant.
_SUFFIXES = ("", ".yaml", ".yml")


def system_file(text: str) -> Path:
    """Return the file that ``text`` means: a path, else the name of an example system.

    Raises UsageFailure.
    """
    path = Path(text)
    if _is_folder(path):
        raise UsageFailure(f"'{text}' is a folder, not a system file")
    if is_there(path):
        return path  # whoever reads it says what is wrong with it
    examples = example_systems()
    if text in examples:
        return examples[text]
    close = nearest_path(path) or nearest(text, examples)
    listed = "example systems: " + ", ".join(sorted(examples))
    raise UsageFailure(
        f"there is no file '{text}' and no example system of that name",
        hint=listed if close is None else f"did you mean '{close}'?\n{listed}",
    )


def example_systems() -> dict[str, Path]:
    """Return the systems that come with the composer, by name."""
    return {path.stem: path for path in sorted(systems_folder().glob("*.yaml"))}


def is_there(path: Path) -> bool:
    """Say whether there is anything at ``path``, also where that cannot be looked up."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return True


def nearest_path(path: Path) -> Path | None:
    """Return the path that ``path``, which is not there, was most likely meant to be, or None."""
    folder: Path | None = path.parent
    if path.parent != path and not _is_folder(path.parent):
        folder = nearest_path(path.parent)
    if folder is None:
        return None
    try:
        there = [other for other in folder.iterdir() if other.suffix in _SUFFIXES and other != path]
    except OSError:
        return None
    beside = {other.stem: other for other in there}
    close = nearest(path.stem, beside)
    return None if close is None else beside[close]


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except (OSError, ValueError):
        return False
