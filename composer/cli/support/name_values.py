"""NAME=VALUE on a command line: values for the arguments that a system declares."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.completion import silent
from composer.cli.support.errors import FAILED
from composer.cli.support.system_arguments import (
    complete_system,
    example_systems,
    path_exists,
    system_file,
)
from composer.cli.support.terminal import as_json, say, say_raw, use_color, write

if TYPE_CHECKING:
    from composer.language.expand.arguments import Declared

_ARGUMENT = re.compile(r"[A-Za-z_][A-Za-z0-9_]*=.*", re.DOTALL)
_LAUNCH_ARGUMENT = re.compile(r"([A-Za-z_][A-Za-z0-9_]*):=(.*)", re.DOTALL)


def split_arguments(words: Iterable[str]) -> tuple[list[str], list[str]]:
    """Split words into files or names, and values of arguments: NAME=VALUE that is not a file.

    Raises typer.BadParameter.
    """
    names: list[str] = []
    arguments: list[str] = []
    for word in words:
        is_file = not re.match(r"\w+:?=", word) or path_exists(Path(word))
        (names if is_file else arguments).append(word)
    return names, _argument_words(arguments)


def _argument_words(words: list[str]) -> list[str]:
    """Return the values of NAME=VALUE. Raises typer.BadParameter."""
    for word in words:
        if _ARGUMENT.fullmatch(word) is None:
            launch = _LAUNCH_ARGUMENT.fullmatch(word)
            example = f"; write {launch[1]}={launch[2]}" if launch is not None else ""
            raise typer.BadParameter(f"'{word}' is not of the form name=value{example}.")
    return words


def _checked_arguments(context: typer.Context, words: list[str] | None) -> list[str]:
    """Check the words of a command, but not while one of them is completed."""
    return (words or []) if context.resilient_parsing else _argument_words(words or [])


@silent
def complete_argument(context: typer.Context, incomplete: str) -> list[str]:
    """Complete the names of the arguments of a system, and their choices."""
    words = context.params.get("arguments") or []
    return _completed_arguments([context.params["system"]], words, incomplete)


@silent
def complete_system_or_argument(context: typer.Context, incomplete: str) -> list[str]:
    """Complete systems, and arguments of those that are given."""
    words = [*(context.params.get("systems") or context.params.get("paths") or ())]
    systems = [word for word in words if path_exists(Path(word)) or word in example_systems()]
    completed = _completed_arguments(systems, words, incomplete)
    is_value = any("=" not in text for text in completed)
    return completed if is_value else [*complete_system(incomplete), *completed]


def _completed_arguments(
    systems: Iterable[str], words: Sequence[str], incomplete: str
) -> list[str]:
    """Return the arguments that continue a word. Bash makes three words of NAME=VALUE."""
    from composer.language.tree import word as value

    name = next((word for word in reversed(words) if word != "="), None)
    completed = []
    for system in systems:
        declared = declared_arguments(system_file(system))
        values = {key: [value(item) for item in declared[key].alternatives] for key in declared}
        if name in values:
            completed += values[name]
        else:
            completed += [f"{key}={text}" for key in values for text in values[key] or [""]]
    return [text for text in completed if text.startswith(incomplete)]


#: The arguments of a system on a command line.
Arguments = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="[NAME=VALUE]...",
        help="Values for the arguments of the system: 'compose run SYSTEM --help-arguments'.",
        callback=_checked_arguments,
        autocompletion=complete_argument,
        show_default=False,
    ),
]


def declared_arguments(path: Path) -> dict[str, Declared]:
    """Return the arguments that a system declares, by name; none if the file cannot be read."""
    from composer.language.document import read_document
    from composer.language.expand.arguments import read_declarations

    tree, _, _ = read_document(path)
    return {} if tree is None else read_declarations(tree, "system") or {}


def print_arguments(text: str) -> None:
    """Print the arguments of a system, as 'ros2 launch --show-args' does.

    Raises typer.Exit if the file cannot be read; the reason is printed.
    """
    from composer.base.diagnostics import has_errors
    from composer.language.document import read_document
    from composer.language.tree import plain, word
    from composer.report.text import render

    path = system_file(text)
    _, _, diagnostics = read_document(path)
    if has_errors(diagnostics):
        say_raw(render(diagnostics, color=use_color(sys.stderr)))
        raise typer.Exit(FAILED)
    declared = declared_arguments(path)
    if not declared:
        say(f"'{text}' has no arguments")
    for name, argument in declared.items():
        kind = f" ({argument.type})" if argument.type else ""
        default = "needs a value"
        if argument.value is not None:
            default = f"default: {as_json(plain(argument.value))}"
        choices = ", ".join(word(item) for item in argument.choices)
        listed = f"; one of: {choices}" if choices else ""
        write(f"{name}{kind}: {argument.description}".rstrip(": "))
        write(f"    {default}{listed}")
