"""A system on the command line: read, checked, its findings shown."""

from __future__ import annotations

import glob
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.terminal import say, use_color

if TYPE_CHECKING:
    from composer.loading import LoadResult


def complete_system(incomplete: str) -> list[str]:
    """Complete the names of example systems, and paths."""
    from composer.cli.support.files import example_systems

    names = [name for name in example_systems() if name.startswith(incomplete)]
    return [*names, *_paths(incomplete)]


def _paths(incomplete: str) -> Iterable[str]:
    """Yield folders and YAML files that begin so, written as they were begun."""
    begun, _, last = incomplete.rpartition("/")
    prefix = f"{begun}/" if "/" in incomplete else ""
    for path in sorted(Path(prefix or ".").glob(f"{glob.escape(last)}*")):
        if path.name.startswith("."):
            continue
        if path.is_dir():
            yield f"{prefix}{path.name}/"
        elif path.suffix in (".yaml", ".yml"):
            yield f"{prefix}{path.name}"


SystemName = Annotated[
    str,
    typer.Argument(
        metavar="SYSTEM",
        help="A system file, or the name of an example system.",
        show_default=False,
        autocompletion=complete_system,
    ),
]
#: Spelled out, for typer takes a metavar that is the parameter's name in capitals for the name.
Namespace = Annotated[
    str | None,
    typer.Option(
        "--namespace", metavar="NAMESPACE", help="Instead of the system's.", show_default=False
    ),
]


def load_system(
    path: Path,
    *,
    shown: str | None = None,
    settings: Iterable[str] = (),
    namespace: str | None = None,
    use_sim_time: bool = False,
) -> LoadResult:
    """Read and check the system in ``path``; errors and warnings go to stderr, with carets.

    What is only good to know stays with ``compose validate``.
    """
    from composer.cli.support.files import is_there
    from composer.diagnostics import Severity
    from composer.loading import load
    from composer.report.text import render
    from composer.resolve import OverrideOptions

    loading = load(
        path,
        shown=str(path) if shown is None or not is_there(Path(shown)) else shown,
        overrides=OverrideOptions(tuple(settings), namespace, use_sim_time),
    )
    pressing = [found for found in loading.diagnostics if found.severity is not Severity.INFO]
    if pressing:
        say(render(pressing, color=use_color(sys.stderr)))
    return loading
