"""``compose validate``: every finding of every file, in one run."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.failure import FINDINGS, UsageFailure
from composer.cli.support.files import example_systems, is_there, nearest_path
from composer.cli.support.help import examples
from composer.cli.support.terminal import say, use_color, write_raw

if TYPE_CHECKING:
    from composer.diagnostics import Diagnostic

EPILOG = examples(
    "compose validate systems nodes",
    "compose validate systems/pipeline.yaml --strict",
    "compose validate systems --format sarif > findings.sarif",
    "compose validate systems --ignore qos-implicit --ignore RC5",
    "cat pipeline.yaml | compose validate -",
)


_STDIN = Path("-")
_NAMED = 3  # of many files


class Format(StrEnum):
    """How findings are written."""

    TEXT = "text"
    JSON = "json"
    SARIF = "sarif"
    GITHUB = "github"


Rules = Annotated[
    list[str] | None,
    typer.Option(metavar="RULE", help="A code (RC301), a band (RC3) or a name; repeatable."),
]


def validate(
    paths: Annotated[
        list[Path],
        typer.Argument(
            metavar="PATH...",
            help="Files, folders (searched for systems and node types), or - for stdin.",
            show_default=False,
        ),
    ],
    *,
    output_format: Annotated[
        Format | None,
        typer.Option(
            "--format",
            "-f",
            help="Default: text; github inside GitHub Actions.",
            show_default=False,
        ),
    ] = None,
    strict: Annotated[
        bool | None,
        typer.Option(
            "--strict/--no-strict",
            help="Warnings count as errors do. Default: as the project says, else not.",
            show_default=False,
        ),
    ] = None,
    select: Rules = None,
    ignore: Rules = None,
    stdin_name: Annotated[
        str,
        typer.Option(
            metavar="PATH", help="What stdin is called; its node types are looked for there."
        ),
    ] = "<stdin>",
) -> None:
    """Check systems and node types without starting anything. Needs no ROS.

    What holds for a whole project can be said in its composer.yaml, or in the table [tool.composer]
    of its pyproject.toml: strict, select, ignore, severity, nodes, interfaces.

    Exit code 1 when there is an error (with --strict: or a warning).
    """
    checked = _check(paths, stdin_name)
    findings = _chosen(checked.findings, select or [], ignore or [])
    _print(findings, output_format or _default_format())
    closing = "" if findings else ": clean"
    say(f"{checked.files} file{'' if checked.files == 1 else 's'} checked{closing}")
    if checked.foreign:
        say(f"left alone, no 'system:' or 'node:' in it: {_first(checked.foreign)}")
    weighs_warnings = checked.strict if strict is None else strict
    if any(_weighs(finding, weighs_warnings) for finding in findings):
        raise typer.Exit(FINDINGS)


@dataclass(frozen=True, slots=True)
class _Checked:
    files: int
    findings: list[Diagnostic]
    strict: bool
    foreign: tuple[Path, ...]


def _check(paths: Sequence[Path], stdin_name: str) -> _Checked:
    from composer.document.limits import MAX_BYTES
    from composer.files import find_files
    from composer.loading import collect_diagnostics, load_bytes, load_files

    for path in paths:
        if path != _STDIN and not is_there(path):
            raise UsageFailure(f"there is no file or folder '{path}'", hint=_meant(path))
    found = find_files(path for path in paths if path != _STDIN)
    loadings = load_files(found.files)
    if _STDIN in paths:
        content = sys.stdin.buffer.read(MAX_BYTES + 1)
        loadings.insert(0, load_bytes(content, Path.cwd(), shown=stdin_name))
    findings = [*found.diagnostics, *collect_diagnostics(loadings)]
    if not loadings and not findings:
        raise UsageFailure("there is no system and no node type in " + ", ".join(map(str, paths)))
    return _Checked(
        files=len(loadings),
        findings=findings,
        strict=any(loading.project.settings.strict for loading in loadings),
        foreign=found.foreign,
    )


def _meant(path: Path) -> str | None:
    """Return a hint at the path that may have been meant; here, examples go by their paths, too."""
    examples = example_systems()
    close = examples.get(str(path)) or nearest_path(path)
    return None if close is None else f"did you mean '{close}'?"


def _first(paths: Sequence[Path]) -> str:
    """Return some of many paths."""
    from composer.report.display import visible

    named = ", ".join(visible(str(path)) for path in paths[:_NAMED])
    return named if len(paths) <= _NAMED else f"{named} and {len(paths) - _NAMED} more"


def _chosen(findings: list[Diagnostic], select: list[str], ignore: list[str]) -> list[Diagnostic]:
    if not select and not ignore:
        return findings
    from composer.report.rule_page import all_rules
    from composer.report.selection import UnknownRule, chosen

    try:
        return chosen(findings, all_rules(), select, ignore)
    except UnknownRule as error:
        raise UsageFailure(str(error), hint=error.hint) from error


def _default_format() -> Format:
    return Format.GITHUB if os.environ.get("GITHUB_ACTIONS") == "true" else Format.TEXT


def _print(findings: list[Diagnostic], output_format: Format) -> None:
    if output_format is Format.TEXT:
        if findings:
            from composer.report.text import render as render_text

            write_raw(render_text(findings, color=use_color(sys.stdout)))
        return
    # The others are seldom wanted, and bring much with them.
    render = import_module(f"composer.report.{output_format}").render
    write_raw(render(findings))


def _weighs(finding: Diagnostic, strict: bool) -> bool:
    from composer.diagnostics import Severity

    return finding.severity is Severity.ERROR or (strict and finding.severity is Severity.WARNING)
