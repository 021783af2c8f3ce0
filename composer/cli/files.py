"""The system that an argument means: by path, or by the name of an example."""

from __future__ import annotations

from pathlib import Path

from composer.cli.failure import UsageFailure
from composer.diagnostics import nearest
from composer.resources import systems_folder


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
