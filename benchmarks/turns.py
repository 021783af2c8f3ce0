"""Lets the composer and others do the same task in turn, and makes rows of what they measured."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

from benchmarks.figures import Row
from benchmarks.held import Held
from benchmarks.processes import ProgramFailed, environment, run_program, started

COMPOSED = "composed"
#: The composer with what it is compared with left out.
UNTRACED = "composed, no tracing"
SINGLE = "SingleThreadedExecutor"
MULTI = "MultiThreadedExecutor"
EVENTS = "EventsExecutor"
#: No executor: what remains when nothing is asked of one.
BARE = "a bare loop in Python"

Rounds = Mapping[str, Sequence[Mapping[str, Any] | None]]
Figure = Callable[[Mapping[str, Any]], float | None]
T = TypeVar("T")
#: A program that hangs is given up; large systems take long to start by hand, as do many processes.
_PATIENCE_S, _PATIENCE_S_PER_NODE, _PATIENCE_S_PER_PROCESS = 15.0, 0.25, 4.0
_SHORT_TURN_S = 0.1


@dataclass(frozen=True, slots=True)
class Case:
    """A task (see :class:`benchmarks.programs.task.Task`), and how often it is done."""

    shape: str
    nodes: int
    seconds: float
    rounds: int
    rate_hz: float = 100.0
    message: str = "String"
    apart: bool = False  # a process for each node

    @property
    def arguments(self) -> tuple[str, ...]:
        """What the program is told."""
        return (
            *("--shape", self.shape, "--nodes", str(self.nodes)),
            *("--seconds", str(self.seconds), "--rate-hz", str(self.rate_hz)),
            *("--message", self.message),
        )

    @property
    def patience_s(self) -> float:
        """How long a program may take."""
        per_node_s = _PATIENCE_S_PER_PROCESS if self.apart else _PATIENCE_S_PER_NODE
        return _PATIENCE_S + per_node_s * self.nodes


def take_turns(ways: Sequence[str], case: Case) -> Rounds:
    """Run each way once a round and return what each measured; None where one gave no result.

    Every other round goes backwards, so that nobody always runs first.
    """
    found: dict[str, list[Mapping[str, Any] | None]] = {way: [] for way in ways}
    for turn in range(case.rounds):
        for way in _in_turn(ways, turn):
            found[way].append(_tried(way, partial(_run, way, case)))
    return found


def take_short_turns(ways: Sequence[str], case: Case) -> Rounds:
    """Let all ways be up at once in each round, and work for a tenth of a second each in turn.

    What a machine does for a second meets all of them. It is for what goes as fast as it can: what
    happens at a rate would be late.
    """
    found: dict[str, list[Mapping[str, Any] | None]] = {way: [] for way in ways}
    for turn in range(case.rounds):
        with ExitStack() as stack:
            programs = {
                way: _tried(way, partial(stack.enter_context, _held(way, case)))
                for way in _in_turn(ways, turn)
            }
            for short_turn in range(round(case.seconds / _SHORT_TURN_S)):
                for way in _in_turn(ways, short_turn):
                    if (program := programs[way]) is not None:
                        program.work(_SHORT_TURN_S)
            for way, program in programs.items():
                found[way].append(None if program is None else _tried(way, program.result))
    return found


def rows(case: str, unit: str, rounds: Rounds, figure: Figure) -> list[Row]:
    """Return a row for each other way."""
    figures = {
        way: tuple(None if result is None else figure(result) for result in results)
        for way, results in rounds.items()
    }
    ours = figures.pop(COMPOSED)
    return [Row(case, unit, way, ours, theirs) for way, theirs in figures.items()]


def _in_turn(ways: Sequence[str], turn: int) -> Sequence[str]:
    return ways if turn % 2 == 0 else tuple(reversed(ways))


def _tried(way: str, measurement: Callable[[], T]) -> T | None:
    """Return what it gives; None where one by hand fails, while ours has to work."""
    try:
        return measurement()
    except ProgramFailed:
        if way in (COMPOSED, UNTRACED):
            raise
        return None


def _run(way: str, case: Case) -> Mapping[str, Any]:
    first, *others = _parts(way, case)
    variables = environment()
    with ExitStack() as stack:
        for other in others:
            stack.enter_context(started(*other, variables=variables))
        return run_program(*first, timeout_s=case.patience_s, variables=variables)


def _held(way: str, case: Case) -> Held:
    return Held(_parts(way, case), environment(), case.patience_s)


def _parts(way: str, case: Case) -> Sequence[Sequence[str]]:
    """Return the processes that a way is made of, each as a program and its arguments."""
    program, executor, *more = {
        COMPOSED: ("composed", "events"),
        UNTRACED: ("composed", "events", "--no-tracing"),
        BARE: ("bare_outside" if case.apart else "bare", "none"),
    }.get(way, ("hand_written", way))
    command = (program, executor, *case.arguments, *more)
    if not case.apart:
        return [command]
    return [(*command, "--part", str(part)) for part in range(case.nodes)]
