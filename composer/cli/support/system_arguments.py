"""The SYSTEM argument of commands: a file, the name of an example system, or a running system."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from enum import Enum, auto
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple, TypedDict, Unpack

import typer

from composer.base.characters import counted
from composer.cli.support.completion import complete_running_system
from composer.cli.support.errors import FAILED, CommandError, UsageError
from composer.cli.support.terminal import say, say_raw, use_color

if TYPE_CHECKING:
    from composer.loading.reported import LoadResult
    from composer.model import System

#: Suffixes of folders and files that are suggested for a mistyped path.
_SUFFIXES = ("", ".yaml", ".yml")


def complete_system(incomplete: str) -> list[str]:
    """Complete the names of the project's systems and of example systems, and paths."""
    from composer.project.node_types import installed_systems

    known = sorted({*project_systems(), *installed_systems(), *example_systems()})
    names = [name for name in known if name.startswith(incomplete)]
    return [*names, *_matching_paths(incomplete)]


SystemName = Annotated[
    str,
    typer.Argument(
        metavar="SYSTEM",
        help="A system file, or the name of a system of the project or of an example system.",
        autocompletion=complete_system,
    ),
]
RunningSystem = Annotated[
    str,
    typer.Argument(
        metavar="SYSTEM",
        help="The name of a running system (pipeline, /robot1/pipeline), or its file.",
        autocompletion=complete_running_system,
    ),
]
#: The default is every running system, or the only one.
AnyRunningSystem = Annotated[
    str | None,
    typer.Argument(
        metavar="[SYSTEM]",
        help="The name of a running system, or its file.",
        autocompletion=complete_running_system,
    ),
]


def system_file(text: str) -> Path:
    """Return the path ``text``, or the file of the system with that name.

    Systems of the project come before those of installed packages, and these before example
    systems. Raises UsageError.
    """
    from composer.project.node_types import installed_systems

    if not text:
        raise UsageError("the name of the system is empty")
    path = Path(text)
    if path_exists(path) and not _is_folder(path):
        return path  # the loader reports what is wrong with it
    own, examples = project_systems(), example_systems()
    if text in own:
        return _own_system(text, own[text], examples.get(text))
    installed = installed_systems()
    if text in installed:
        return installed[text]
    if text in examples:
        return examples[text]
    if _is_folder(path):
        raise UsageError(f"'{text}' is a folder, not a system file")
    from composer.base.diagnostics import nearest

    near = nearest_path(path)
    is_file = near is not None and not _is_folder(near)
    close = near if is_file else nearest(text, (*own, *installed, *examples))
    listed = "example systems: " + ", ".join(sorted(examples))
    if installed:
        packages = sorted(name for name in installed if "/" in name)
        listed = f"installed systems: {', '.join(packages)}\n{listed}"
    raise UsageError(
        f"there is no file '{text}' and no example system of that name",
        hint=listed if close is None else f"did you mean '{close}'?\n{listed}",
    )


def project_systems() -> dict[str, Path]:
    """Return the systems of the current folder's project, by name.

    They are the YAML files in the folder ``systems`` of the project, and in the current folder.
    """
    from composer.project import SETTINGS_FILE, SYSTEMS, Project

    here = Path.cwd()
    found: dict[str, Path] = {}
    for folder in (here, Project.at(here).root / SYSTEMS):
        for suffix in _SUFFIXES:
            files = sorted(folder.glob(f"*{suffix}")) if suffix else ()
            found |= {file.stem: file for file in files if file.name != SETTINGS_FILE}
    return found


def _own_system(name: str, path: Path, example: Path | None) -> Path:
    """Return ``path``, a system of the project, and name the example system that it hides.

    Raises UsageError if it belongs to another user, whose file must be named explicitly.
    """
    from composer.base.folders import TrustedUsers
    from composer.base.source import shown_path

    shown = shown_path(path)
    if TrustedUsers.own().other_owner(path) is not None:
        raise UsageError(
            f"'{name}' would run '{shown}', which belongs to another user",
            hint="give the path of the file that you want to run",
        )
    if example is not None and not path.samefile(example):
        say(f"compose: '{name}' is '{shown}'; the example system of that name is '{example}'")
    return Path(shown)


def example_systems() -> dict[str, Path]:
    """Return the bundled example systems, by name."""
    from composer.base.folders import systems_folder

    return {path.stem: path for path in sorted(systems_folder().glob("*.yaml"))}


def path_exists(path: Path) -> bool:
    """Say whether ``path`` exists; True where that cannot be determined."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return True


def check_exists(path: Path) -> None:
    """Raise UsageError if there is no such path.

    The hint is the path of the system of that name, or a similar path.
    """
    from composer.base.source import shown_path

    if not path_exists(path):
        named = example_systems() | project_systems()
        close = named.get(str(path)) or nearest_path(path)
        hint = None if close is None else f"did you mean '{shown_path(close)}'?"
        raise UsageError(f"there is no file or folder '{path}'", hint=hint)


def nearest_path(path: Path) -> Path | None:
    """Return the existing path most similar to ``path``, which does not exist, or None."""
    from composer.base.diagnostics import nearest

    folder: Path | None = path.parent
    if path.parent != path and not _is_folder(path.parent):
        folder = nearest_path(path.parent)
    if folder is None:
        return None
    try:
        entries = [item for item in folder.iterdir() if item.suffix in _SUFFIXES and item != path]
    except OSError:
        return None
    by_stem = {entry.stem: entry for entry in entries}
    close = nearest(path.stem, by_stem)
    return None if close is None else by_stem[close]


class ShowWarnings(Enum):
    """What is printed of the warnings about a system, besides its errors."""

    ALL = auto()
    COUNT = auto()
    NONE = auto()


class LoadOptions(TypedDict, total=False):
    """How to load a system: the options of a command that override its values, and ``warnings``.

    If it ``needs_values``, as by default, all arguments without a default have one.
    """

    settings: Iterable[str] | None
    namespace: str | None
    use_sim_time: bool
    warnings: ShowWarnings
    needs_values: bool


def load_system(
    path: Path, shown: str, arguments: Iterable[str] | None = (), **options: Unpack[LoadOptions]
) -> LoadResult:
    """Read and check the system in ``path``; print errors, and warnings as chosen, to stderr.

    Only ``compose validate`` reports diagnostics of severity info.
    """
    from composer.base.diagnostics import Severity
    from composer.loading import load
    from composer.model.resolve import OverrideOptions
    from composer.report.text import render

    overrides = OverrideOptions(
        tuple(options.get("settings") or ()),
        options.get("namespace"),
        options.get("use_sim_time", False),
        tuple(arguments or ()),
    )
    result = load(
        path,
        shown=shown if path_exists(Path(shown)) else str(path),
        overrides=overrides,
        needs_values=options.get("needs_values", True),
    )
    warnings = options.get("warnings", ShowWarnings.COUNT)
    severities = {Severity.ERROR, *([Severity.WARNING] if warnings is ShowWarnings.ALL else [])}
    reported = [item for item in result.diagnostics if item.severity in severities]
    if reported:
        say_raw(render(reported, color=use_color(sys.stderr)))
    count = sum(item.severity is Severity.WARNING for item in result.diagnostics)
    if count and warnings is ShowWarnings.COUNT:
        say(f"{counted(count, 'warning')}: see 'compose validate {shown}'")
    return result


class RunnableSystem(NamedTuple):
    """A system without errors, its file, and what else was read with it."""

    system: System
    path: Path
    result: LoadResult


def runnable_system(
    text: str,
    arguments: Iterable[str] | None = (),
    *,
    exit_code: int = FAILED,
    **options: Unpack[LoadOptions],
) -> RunnableSystem:
    """Return the system of a SYSTEM argument; print its diagnostics as :func:`load_system` does.

    ``arguments`` are values of its arguments, as ``name=value``.

    Raises UsageError; CommandError or typer.Exit with ``exit_code`` if it is not runnable.
    """
    path = system_file(text)
    result = load_system(path, text, arguments, **options)
    if result.scenario is not None:
        raise CommandError(
            f"'{text}' is a scenario, not a system",
            hint=f"run it with: compose test {text}",
            exit_code=exit_code,
        )
    if result.system is not None and result.system.node_type:
        raise CommandError(
            f"'{text}' is a node type, not a system",
            hint="use it in a system under 'nodes:'; 'compose validate' checks it on its own",
            exit_code=exit_code,
        )
    if result.system is None or not result.is_runnable:
        raise typer.Exit(exit_code)
    return RunnableSystem(result.system, path, result)


def running_system_name(text: str) -> str:
    """Return the name of a running system; for a file, the name of the system in it.

    Raises CommandError if the file cannot be read or is not a system.
    """
    if not text.endswith((".yaml", ".yml")):
        return text
    from composer.language.document import read_document
    from composer.language.tree import Scalar

    tree, _, diagnostics = read_document(Path(text))
    name = tree.get("system") if tree is not None else None
    if isinstance(name, Scalar) and isinstance(name.value, str):
        return name.value
    reason = diagnostics[0].message if diagnostics else "it has no key 'system'"
    hint = diagnostics[0].hint if diagnostics else None
    raise CommandError(f"'{text}' is not a system: {reason}", hint=hint)


def _matching_paths(incomplete: str) -> Iterable[str]:
    """Yield the folders and YAML files that start with ``incomplete``, written the same way."""
    import glob

    typed, _, last = incomplete.rpartition("/")
    prefix = f"{typed}/" if "/" in incomplete else ""
    for path in sorted(Path(prefix or ".").glob(f"{glob.escape(last)}*")):
        if path.name.startswith("."):
            continue
        if path.is_dir():
            yield f"{prefix}{path.name}/"
        elif path.suffix in (".yaml", ".yml"):
            yield f"{prefix}{path.name}"


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except (OSError, ValueError):
        return False
