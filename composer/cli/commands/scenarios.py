"""``compose test``: run scenarios, each in a process of its own."""

from __future__ import annotations

import os
import re
import shutil
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.errors import FAILED, CommandError, UsageError, require_extra
from composer.cli.support.options import examples, quantity
from composer.cli.support.ros import require_interfaces, require_modules, require_ros
from composer.cli.support.system_arguments import check_exists
from composer.cli.support.terminal import say, use_color, write, write_raw

if TYPE_CHECKING:
    from composer.loading.reported import LoadResult
    from composer.scenarios.processes import Job
    from composer.scenarios.report import Case
    from composer.scenarios.runner import Result

EPILOG = examples(
    "compose test                                  run the scenarios in the folder 'scenarios'",
    "compose test scenarios/docking.yaml           run one scenario",
    "compose test -k 'docking and not slow'        run those with such names",
    "compose test --repeat 50 -j 4                 run each 50 times, four side by side",
    "compose test --explore 200 scenarios/dock.yaml  look for timing that makes it fail",
    "compose test --real-time                      run in real time",
    "compose test --junit build/scenarios.xml      write the results for CI",
    "compose test --bag-on-failure                 keep what failed runs have published",
)

_FOLDER = Path("scenarios")
#: What names of bags do not have, and the longest part of a scenario's name in them.
_UNSAFE, _LONGEST_NAME = re.compile(r"[^\w-]"), 100


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
    real_time: Annotated[bool, typer.Option("--real-time", help="Run in real time.")] = False,
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
    variations: Annotated[
        int | None,
        typer.Option(
            "--explore",
            metavar="N",
            min=1,
            help="Run each scenario with N variations as well, within the bounds in `explore`.",
        ),
    ] = None,
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
    bag_on_failure: Annotated[
        bool,
        typer.Option(
            "--bag-on-failure", help="Keep a bag of each failed run, in the folder 'bags'."
        ),
    ] = False,
    timeout: Annotated[
        float, quantity("SECONDS", "--timeout", help="Maximum real time of a run.")
    ] = 120.0,
) -> None:
    """Run scenarios, which say what systems must do.

    They run in virtual time, which jumps whenever nothing is left to do. A failure shows the
    expectation in the file, what was seen instead, and the last events before.

    Exit code 1 if a scenario fails or its file has errors.
    """
    started_s = time.monotonic()
    if variations is not None:
        _check_exploration(real_time, repeat, bag_on_failure)
    results = _selected(_loaded(paths or [_FOLDER]), expression)
    require_ros("compose test")
    from composer.scenarios.processes import run_jobs
    from composer.scenarios.report import details, summary
    from composer.scenarios.runner import Options

    workers = jobs or (1 if real_time else os.cpu_count() or 1)
    cases: list[Case] = []
    options = Options(real_time, seed, traced=repeat > 1 and not real_time)
    bags = _new_bags() if bag_on_failure else None
    run_all = partial(run_jobs, options=options, workers=workers, timeout_s=timeout)
    if variations is not None:
        from composer.scenarios.exploration import explore

        run_all = partial(explore, options=options, count=variations, timeout_s=timeout)
    for case in _run(results, run_all, repeat, bags):
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


def _check_exploration(real_time: bool, repeat: int, bag_on_failure: bool) -> None:
    """Raise UsageError or CommandError if ``--explore`` cannot be used."""
    if real_time:
        raise UsageError("--explore needs virtual time: leave out --real-time")
    if repeat > 1:
        raise UsageError("--explore runs each variation once: leave out --repeat")
    if bag_on_failure:
        hint = "repeat what was found, then record it with --bag-on-failure"
        raise UsageError("--explore records no bags: leave out --bag-on-failure", hint=hint)
    require_extra("compose test --explore", "explore", "hypothesis")


def _loaded(paths: Sequence[Path]) -> list[LoadResult]:
    """Return the scenarios in files and folders. Raises UsageError."""
    from composer.language.schema import SCENARIO, kind_of
    from composer.loading import load_files
    from composer.loading.merging import read
    from composer.project.files import find_files

    for path in paths:
        check_exists(path)
    scenarios = []
    for path in find_files(paths).files:
        tree = read(path).tree
        if tree is not None and kind_of(tree) == SCENARIO:
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


def _new_bags() -> Path:
    """Return a folder for the bags of this command. Raises CommandError."""
    from composer.cli.support.bags import bag_errors

    with bag_errors():
        from composer.bags.system_recording import new_folder

        return new_folder(Path("bags"), "test")


def _run(
    results: Sequence[LoadResult],
    run_all: Callable[[Sequence[Job]], Iterator[Result]],
    repeat: int,
    bags: Path | None,
) -> Iterator[Case]:
    """Run the scenarios without errors, and yield all cases in order.

    ``bags`` is a folder for a bag of each failed run. If a run of several fails, the bag of the
    first one that has passed is kept as well, to be compared with.
    """
    from composer.base.characters import escape_line
    from composer.base.diagnostics import Severity
    from composer.scenarios.processes import Job
    from composer.scenarios.report import Case
    from composer.scenarios.runner import difference

    jobs: list[Job] = []
    for result in results:
        if result.is_runnable and result.scenario is not None and result.system is not None:
            require_interfaces(result.system)
            require_modules(result.system)
            for _ in range(repeat):
                name = f"{len(jobs) + 1}-{_UNSAFE.sub('_', _name(result))[:_LONGEST_NAME]}"
                bag = None if bags is None else bags / name
                jobs.append(Job(result.scenario, result.system, bag))
    outcomes = zip(jobs, run_all(jobs), strict=True)
    for result in results:
        path, scenario = escape_line(result.source.path), result.scenario
        if not result.is_runnable or scenario is None:
            errors = [item for item in result.diagnostics if item.severity is Severity.ERROR]
            yield Case(path, _name(result), errors=errors)
            continue
        first = None
        passed: list[Job] = []
        for number in range(1, repeat + 1):
            job, outcome = next(outcomes)
            first = first or outcome
            differs = difference(scenario, first, outcome) if not outcome.failures else None
            outcome.failures += [] if differs is None else [differs]
            name = f"{scenario.name}[{number}]" if repeat > 1 else scenario.name.value
            case = Case(path, name, scenario.for_s.value, outcome)
            if case.has_passed:
                passed.append(job)
                _discard(passed[1:])
            yield case
        if len(passed) == repeat:
            _discard(passed)


def _discard(jobs: Sequence[Job]) -> None:
    """Delete the bags of runs."""
    for job in jobs:
        if job.bag is not None:
            shutil.rmtree(job.bag, ignore_errors=True)
            with suppress(OSError):
                job.bag.parent.rmdir()  # if it is empty


def _write_junit(path: Path, cases: Sequence[Case], took_s: float) -> None:
    from composer.scenarios.report import junit

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(junit(cases, took_s), encoding="utf-8")
    except OSError as error:
        raise CommandError(f"'{path}' cannot be written: {error.strerror}") from error
