"""``compose validate``: report all diagnostics of all files in one run."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from composer.base.characters import counted
from composer.base.fast_dataclass import dataclass
from composer.cli.commands.stubs import update_typings
from composer.cli.support.completion import complete_rule
from composer.cli.support.errors import FAILED, UsageError
from composer.cli.support.name_values import complete_system_or_argument, split_arguments
from composer.cli.support.options import examples
from composer.cli.support.system_arguments import check_exists
from composer.cli.support.terminal import columns, say, use_color, write, write_raw

if TYPE_CHECKING:
    from composer.base.diagnostics import Diagnostic
    from composer.project import Project

EPILOG = examples(
    "compose validate                                all files of the current folder",
    "compose validate systems nodes",
    "compose validate systems/pipeline.yaml --strict",
    "compose validate mapping.yaml lidar=ouster      with this value of an argument only",
    "compose validate systems --format sarif > report.sarif",
    "compose validate systems --ignore qos-implicit --ignore RC5",
    "cat pipeline.yaml | compose validate -",
    "compose validate --explain RC202      what a rule is about, with examples",
    "compose validate --explain RC         list all rules",
)


_STDIN = Path("-")
_MAX_LISTED = 3


class ReportFormat(StrEnum):
    """The formats of reports."""

    TEXT = "text"
    JSON = "json"
    SARIF = "sarif"
    GITHUB = "github"


Rules = list[str] | None
_RULE = "a code (RC301), a code prefix (RC3) or a name. Repeatable."


def validate(
    paths: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[PATH]... [NAME=VALUE]...",
            help="Files, folders to search for files, or - for stdin, and"
            " arguments of the systems. Default: the current folder.",
            autocompletion=complete_system_or_argument,
        ),
    ] = None,
    *,
    output_format: Annotated[
        ReportFormat | None,
        typer.Option(
            "--format", "-f", help="Output format. Default: text, or github in GitHub Actions."
        ),
    ] = None,
    strict: Annotated[
        bool | None,
        typer.Option(
            "--strict/--no-strict",
            help="Treat warnings as errors. Default: as set in the project, else no.",
        ),
    ] = None,
    select: Annotated[
        Rules, typer.Option(metavar="RULE", help=f"Report only this rule: {_RULE}")
    ] = None,
    ignore: Annotated[
        Rules, typer.Option(metavar="RULE", help=f"Do not report this rule: {_RULE}")
    ] = None,
    max_diagnostics: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=0,
            help="Show at most N diagnostics as text, errors first; 0 for all. Default: 200.",
        ),
    ] = None,
    stdin_name: Annotated[
        str,
        typer.Option(
            metavar="PATH", help="The file name of stdin, used in reports and to find node types."
        ),
    ] = "<stdin>",
    explain: Annotated[
        str | None,
        typer.Option(
            metavar="RULE",
            help="Explain a rule, or list the rules with this code prefix; check no files.",
            autocompletion=complete_rule,
        ),
    ] = None,
) -> None:
    """Check systems, node types and scenarios.

    Nothing is started, and ROS is not needed. All combinations of arguments are checked. An
    argument given as NAME=VALUE is checked with this value only. Settings of a project are in its
    composer.yaml: strict, select, ignore, severity, nodes and interfaces.

    The formats json, sarif and github contain all diagnostics.

    Exit code 1 if there are errors, or warnings with --strict, even if they are not shown.
    """
    if explain is not None:
        _explain(explain)
        return
    names, arguments = split_arguments(paths or [])
    checked = _check([Path(name) for name in names or ["."]], stdin_name, arguments)
    diagnostics = _selected(checked.diagnostics, select or [], ignore or [])
    _print(diagnostics, output_format or _default_format(), max_diagnostics)
    suffix = "" if diagnostics else ": no problems found"
    say(f"{counted(checked.files, 'file')} checked{suffix}")
    for project in checked.projects:
        update_typings(project)
    if checked.foreign:
        say(f"skipped, without 'system:', 'node:' or 'scenario:': {_listed(checked.foreign)}")
    is_strict = checked.strict if strict is None else strict
    if any(_is_error(item, is_strict) for item in diagnostics):
        raise typer.Exit(FAILED)


@dataclass(frozen=True, slots=True)
class _Checked:
    files: int
    diagnostics: list[Diagnostic]
    strict: bool
    foreign: tuple[Path, ...]
    projects: tuple[Project, ...]


def _check(paths: Sequence[Path], stdin_name: str, arguments: Sequence[str]) -> _Checked:
    from composer.language.rules import MAX_BYTES
    from composer.loading import load_bytes, load_files
    from composer.loading.reported import collect_diagnostics
    from composer.model.resolve import OverrideOptions
    from composer.project.files import find_files

    for path in paths:
        if path != _STDIN:
            check_exists(path)
    found = find_files(path for path in paths if path != _STDIN)
    overrides = OverrideOptions(arguments=tuple(arguments))
    results = load_files(found.files, overrides)
    if _STDIN in paths:
        content = sys.stdin.buffer.read(MAX_BYTES + 1)
        results.insert(0, load_bytes(content, Path.cwd(), shown=stdin_name, overrides=overrides))
    diagnostics = [*found.diagnostics, *collect_diagnostics(results)]
    if not results and not diagnostics:
        raise UsageError("there is no system and no node type in " + ", ".join(map(str, paths)))
    return _Checked(
        files=len(results),
        diagnostics=diagnostics,
        strict=any(result.project.settings.strict for result in results),
        foreign=found.foreign,
        projects=tuple({item.project.root: item.project for item in results}.values()),
    )


def _explain(text: str) -> None:
    """Print the page of a rule, or the rules with a code prefix. Raises UsageError."""
    from composer.base.diagnostics import suggestion
    from composer.report.rules import all_rules, explain, find_rule

    rules = all_rules()
    rule = find_rule(text, rules)
    matching = [item for item in rules if item.code.startswith(text.upper())]
    if rule is not None:
        write_raw(explain(rule))
    elif matching:
        write(columns([(item.code, item.severity.value, item.name) for item in matching]))
    else:
        names = [name for item in rules for name in (item.code, item.name)]
        raise UsageError(f"there is no rule '{text}'", hint=suggestion(text, names))


def _listed(paths: Sequence[Path]) -> str:
    """Return the first paths, and how many more there are."""
    from composer.base.characters import shortened, visible

    return shortened([visible(str(path)) for path in paths], _MAX_LISTED)


def _selected(
    diagnostics: list[Diagnostic], select: list[str], ignore: list[str]
) -> list[Diagnostic]:
    if not select and not ignore:
        return diagnostics
    from composer.report.rules import UnknownRule, all_rules, select_diagnostics

    try:
        return select_diagnostics(diagnostics, all_rules(), select, ignore)
    except UnknownRule as error:
        raise UsageError(str(error), hint=error.hint) from error


def _default_format() -> ReportFormat:
    return ReportFormat.GITHUB if os.environ.get("GITHUB_ACTIONS") == "true" else ReportFormat.TEXT


def _print(
    diagnostics: list[Diagnostic], output_format: ReportFormat, max_diagnostics: int | None
) -> None:
    if output_format is ReportFormat.TEXT:
        if diagnostics:
            _print_text(diagnostics, max_diagnostics)
        return
    # Imported on demand: the other formats are rarely used and slow to import.
    from composer.report import machine

    write_raw(machine.RENDERERS[output_format](diagnostics))


def _print_text(diagnostics: list[Diagnostic], max_diagnostics: int | None) -> None:
    from composer.report.text import MAX_DIAGNOSTICS, render

    maximum = MAX_DIAGNOSTICS if max_diagnostics is None else max_diagnostics or None
    write_raw(render(diagnostics, color=use_color(sys.stdout), maximum=maximum))
    if maximum is not None and len(diagnostics) > maximum:
        say("use --max-diagnostics 0 to show all diagnostics")


def _is_error(diagnostic: Diagnostic, strict: bool) -> bool:
    from composer.base.diagnostics import Severity

    severity = diagnostic.severity
    return severity is Severity.ERROR or (strict and severity is Severity.WARNING)
