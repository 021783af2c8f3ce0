"""Lets the composer and others do the same task in turn, and makes rows of what they measured."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

from benchmarks.figures import Row
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
#: A program that hangs is given up; large systems take long to start by hand, as do many processes.
_PATIENCE_S, _PATIENCE_S_PER_NODE, _PATIENCE_S_PER_PROCESS = 15.0, 0.25, 4.0


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


def take_turns(ways: Sequence[str], case: Case) -> Rounds:
    """Run each way once a round and return what each measured; None where one gave no result.

    Every other round goes backwards, so that nobody always runs first.
    """
    found: dict[str, list[Mapping[str, Any] | None]] = {way: [] for way in ways}
    for turn in range(case.rounds):
        for way in ways if turn % 2 == 0 else tuple(reversed(ways)):
            found[way].append(_run(way, case))
    return found


def rows(case: str, unit: str, rounds: Rounds, figure: Figure) -> list[Row]:
    """Return a row for each other way."""
    figures = {
        way: tuple(None if result is None else figure(result) for result in results)
        for way, results in rounds.items()
    }
    ours = figures.pop(COMPOSED)
    return [Row(case, unit, way, ours, theirs) for way, theirs in figures.items()]


def _run(way: str, case: Case) -> Mapping[str, Any] | None:
    program, executor, *more = {
        COMPOSED: ("composed", "events"),
        UNTRACED: ("composed", "events", "--no-tracing"),
        BARE: ("bare_outside" if case.apart else "bare", "none"),
    }.get(way, ("hand_written", way))
    command = (program, executor, *case.arguments, *more)
    try:
        with ExitStack() as stack:
            domain = environment()
            if case.apart:
                for part in range(1, case.nodes):
                    others = (*command, "--part", str(part))
                    stack.enter_context(started(*others, variables=domain))
                command = (*command, "--part", "0")
            per_node_s = _PATIENCE_S_PER_PROCESS if case.apart else _PATIENCE_S_PER_NODE
            patience_s = _PATIENCE_S + per_node_s * case.nodes
            return run_program(*command, timeout_s=patience_s, variables=domain)
    except ProgramFailed:
        if program == "composed":
            raise  # ours has to work
        return None
