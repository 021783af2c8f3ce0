"""Measure the composer and its baselines alternately with the same task."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

from benchmarks.figures import Row
from benchmarks.paused import PausedPrograms
from benchmarks.processes import ProgramFailed, environment, run_program, started

COMPOSED = "composed"
#: The composer without recording callback timings.
UNTRACED = "composed, no tracing"
SINGLE = "SingleThreadedExecutor"
MULTI = "MultiThreadedExecutor"
EVENTS = "EventsExecutor"
#: A loop without an executor: the lower bound for Python code.
BARE = "bare Python loop"

Rounds = Mapping[str, Sequence[Mapping[str, Any] | None]]
Figure = Callable[[Mapping[str, Any]], float | None]
T = TypeVar("T")
#: Time limits of a program. Hand-written large systems and many processes start slowly.
_TIMEOUT_S, _TIMEOUT_S_PER_NODE, _TIMEOUT_S_PER_PROCESS = 15.0, 0.25, 4.0
_TIME_SLICE_S = 0.1


@dataclass(frozen=True, slots=True)
class Case:
    """A task (see :class:`benchmarks.programs.task.Task`) and the number of rounds."""

    shape: str
    nodes: int
    seconds: float
    rounds: int
    rate_hz: float = 100.0
    message: str = "String"
    apart: bool = False  # one process per node
    is_one_system: bool = False  # these are the processes of one system of the composer

    @property
    def arguments(self) -> tuple[str, ...]:
        """The command line arguments of the program."""
        return (
            *("--shape", self.shape, "--nodes", str(self.nodes)),
            *("--seconds", str(self.seconds), "--rate-hz", str(self.rate_hz)),
            *("--message", self.message),
        )

    @property
    def timeout_s(self) -> float:
        """The time limit of the program."""
        per_node_s = _TIMEOUT_S_PER_PROCESS if self.apart else _TIMEOUT_S_PER_NODE
        return _TIMEOUT_S + per_node_s * self.nodes


def run_rounds(variants: Sequence[str], case: Case) -> Rounds:
    """Run each variant once per round and return the results; None where one failed.

    The order is reversed in every other round, so that no variant always runs first.
    """
    results: dict[str, list[Mapping[str, Any] | None]] = {variant: [] for variant in variants}
    for turn in range(case.rounds):
        for variant in _ordered(variants, turn):
            results[variant].append(_tried(variant, partial(_run, variant, case)))
    return results


def run_time_slices(variants: Sequence[str], case: Case) -> Rounds:
    """Keep all variants up during a round, and run them alternately for 0.1 s each.

    Other load on the machine thus affects all variants equally. Not for tasks with a fixed rate,
    which would be late.
    """
    results: dict[str, list[Mapping[str, Any] | None]] = {variant: [] for variant in variants}
    for turn in range(case.rounds):
        with ExitStack() as stack:
            programs = {
                variant: _tried(variant, partial(stack.enter_context, _held(variant, case)))
                for variant in _ordered(variants, turn)
            }
            for time_slice in range(round(case.seconds / _TIME_SLICE_S)):
                for variant in _ordered(variants, time_slice):
                    if (program := programs[variant]) is not None:
                        program.work(_TIME_SLICE_S)
            for variant, program in programs.items():
                results[variant].append(
                    None if program is None else _tried(variant, program.result)
                )
    return results


def rows(case: str, unit: str, rounds: Rounds, figure: Figure) -> list[Row]:
    """Return a row per baseline."""
    figures = {
        variant: tuple(None if result is None else figure(result) for result in results)
        for variant, results in rounds.items()
    }
    ours = figures.pop(COMPOSED)
    return [Row(case, unit, variant, ours, theirs) for variant, theirs in figures.items()]


def _ordered(variants: Sequence[str], turn: int) -> Sequence[str]:
    return variants if turn % 2 == 0 else tuple(reversed(variants))


def _tried(variant: str, measurement: Callable[[], T]) -> T | None:
    """Return the result, or None if a baseline fails; failures of the composer are raised."""
    try:
        return measurement()
    except ProgramFailed:
        if variant in (COMPOSED, UNTRACED):
            raise
        return None


def _run(variant: str, case: Case) -> Mapping[str, Any]:
    first, *others = _parts(variant, case)
    variables = environment()
    with ExitStack() as stack:
        for other in others:
            stack.enter_context(started(*other, variables=variables))
        return run_program(*first, timeout_s=case.timeout_s, variables=variables)


def _held(variant: str, case: Case) -> PausedPrograms:
    return PausedPrograms(_parts(variant, case), environment(), case.timeout_s)


def _parts(variant: str, case: Case) -> Sequence[Sequence[str]]:
    """Return the processes of a variant, each as a program and its arguments."""
    program, executor, *more = {
        COMPOSED: ("composed", "events"),
        UNTRACED: ("composed", "events", "--no-tracing"),
        BARE: ("bare_external" if case.apart else "bare", "none"),
    }.get(variant, ("hand_written", variant))
    command = (program, executor, *case.arguments, *more)
    if case.is_one_system and variant == COMPOSED:
        return [(*command, "--split")]
    if not case.apart:
        return [command]
    return [(*command, "--part", str(part)) for part in range(case.nodes)]
