"""``compose test``: run scenarios, each in a process of its own."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.errors import FAILED, CommandError, UsageError
from composer.cli.support.options import examples, finite
from composer.cli.support.ros import require_interfaces, require_modules, require_ros
from composer.cli.support.system_arguments import nearest_path, path_exists
from composer.cli.support.terminal import say, use_color, write, write_raw

if TYPE_CHECKING:
    from composer.loading.reported import LoadResult
    from composer.scenarios.report import Case
    from composer.scenarios.runner import Options

EPILOG = examples(
    "compose test                                  run the scenarios in the folder 'scenarios'",
    "compose test scenarios/docking.yaml           run one scenario",
    "compose test -k 'docking and not slow'        run those with such names",
    "compose test --repeat 50 -j 4                 run each 50 times, four side by side",
    "compose test --real-time                      with the time of the computer",
    "compose test --junit build/scenarios.xml      write the results for CI",
)

_FOLDER = Path("scenarios")


def test(
    paths: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="PATH...",
            help="Scenarios, and folders to search for them.",
            show_default="scenarios",
        ),
    ] = None,
    *,
    real_time: Annotated[
        bool, typer.Option("--real-time", help="Run in the time of the computer.")
    ] = False,
    seed: Annotated[
        int | None,
        typer.Option("--seed", metavar="N", help="The seed of random numbers, for all scenarios."),
    ] = None,
    repeat: Annotated[
        int,
        typer.Option(
            "--repeat", metavar="N", min=1, help="Run each scenario N times, and compare the runs."
        ),
    ] = 1,
    expression: Annotated[
        str | None,
        typer.Option(
            "-k",
            metavar="EXPR",
            help="Run only scenarios whose path or name contains these words: with and, or, not.",
        ),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option(
            "--jobs",
            "-j",
            metavar="N",
            min=1,
            help="How many scenarios run side by side.",
            show_default="number of processors; 1 with --real-time",
        ),
    ] = None,
    junit: Annotated[
        Path | None,
        typer.Option("--junit", metavar="FILE", help="Write the results as JUnit XML as well."),
    ] = None,
    timeout: Annotated[
        float,
        typer.Option(
            "--timeout",
            metavar="SECONDS",
            min=0.0,
            callback=finite,
            help="Maximum time of the computer for a run.",
        ),
    ] = 120.0,
) -> None:
    """Run scenarios, which say what systems must do.

    They run in virtual time, which jumps whenever nothing is left to do. A failure shows the
    expectation in the file, what was seen instead, and the last events before.

    Exit code 1 if a scenario fails or its file has errors.
    """
    started_s = time.monotonic()
    results = _selected(_loaded(paths or [_FOLDER]), expression)
    require_ros("compose test")
    from composer.scenarios.report import details, summary
    from composer.scenarios.runner import Options

    workers = jobs or (1 if real_time else os.cpu_count() or 1)
    cases: list[Case] = []
    options = Options(real_time, seed, traced=repeat > 1 and not real_time)
    for case in _run(results, options, workers, timeout, repeat):
        cases.append(case)
        write(case.line)
    color = use_color(sys.stdout)
    for case in cases:
        if not case.has_passed:
            write_raw(f"\n{details(case, color=color)}\n")
    took_s = time.monotonic() - started_s
    if junit is not None:
        _write_junit(junit, cases, took_s)
    say(summary(cases, took_s))
    if not all(case.has_passed for case in cases):
        raise typer.Exit(FAILED)


def _loaded(paths: Sequence[Path]) -> list[LoadResult]:
    """Return the scenarios in files and folders. Raises UsageError."""
    from composer.language.schema import kind_of, kinds
    from composer.loading import load_files
    from composer.loading.merging import read
    from composer.project.files import find_files

    for path in paths:
        if not path_exists(path):
            near = nearest_path(path)
            hint = None if near is None else f"did you mean '{near}'?"
            raise UsageError(f"there is no file or folder '{path}'", hint=hint)
    scenarios = []
    for path in find_files(paths).files:
        tree = read(path).tree
        if tree is not None and kind_of(tree) == kinds.SCENARIO:
            scenarios.append(path)
        elif path in paths:
            hint = "a scenario begins with 'scenario: <name>'"
            raise UsageError(f"'{path}' is not a scenario", hint=hint)
    if not scenarios:
        raise UsageError("there is no scenario in " + ", ".join(map(str, paths)))
    return load_files(scenarios)


def _selected(results: list[LoadResult], expression: str | None) -> list[LoadResult]:
    """Return the scenarios that ``-k`` selects. Raises UsageError."""
    if expression is None:
        return results
    from composer.language.expressions import ExpressionError, compile_expression

    try:
        compiled = compile_expression(expression)
    except ExpressionError as error:
        hint = "write words with and, or, not: 'docking and not slow'"
        raise UsageError(f"-k '{expression}': {error.message}", hint=hint) from error
    words = {path.root for path in compiled.paths}
    selected = [
        result
        for result in results
        if compiled.holds({word: word in f"{result.source.path} {_name(result)}" for word in words})
    ]
    if not selected:
        raise UsageError(f"-k '{expression}' selects none of {len(results)} scenarios")
    return selected


def _name(result: LoadResult) -> str:
    return "" if result.scenario is None else result.scenario.name.value


def _run(
    results: Sequence[LoadResult], options: Options, workers: int, timeout_s: float, repeat: int
) -> Iterator[Case]:
    """Run the scenarios without errors, and yield all cases in order."""
    from composer.base.diagnostics import Severity
    from composer.scenarios.processes import Job, run_jobs
    from composer.scenarios.report import Case
    from composer.scenarios.runner import difference

    jobs: list[Job] = []
    for result in results:
        if result.is_runnable and result.scenario is not None and result.system is not None:
            require_interfaces(result.system)
            require_modules(result.system)
            jobs += [Job(result.scenario, result.system)] * repeat
    outcomes = run_jobs(jobs, options, workers, timeout_s)
    for result in results:
        path, scenario = result.source.path, result.scenario
        if not result.is_runnable or scenario is None:
            errors = [item for item in result.diagnostics if item.severity is Severity.ERROR]
            yield Case(path, _name(result), errors=errors)
            continue
        first = None
        for number in range(1, repeat + 1):
            name = f"{scenario.name}[{number}]" if repeat > 1 else scenario.name.value
            outcome = next(outcomes)
            first = first or outcome
            differs = difference(scenario, first, outcome) if not outcome.failures else None
            outcome.failures += [] if differs is None else [differs]
            yield Case(path, name, scenario.for_s.value, outcome)


def _write_junit(path: Path, cases: Sequence[Case], took_s: float) -> None:
    from composer.scenarios.report import junit

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(junit(cases, took_s), encoding="utf-8")
    except OSError as error:
        raise CommandError(f"'{path}' cannot be written: {error.strerror}") from error
