"""How long commands to what runs take: from the start of the process to its end, with the answer.

Beside them run systems/pipeline.yaml and a lifecycle node that somebody else wrote. What it is held
against is a script by hand that knows the service it wants and asks it once; it lists nothing and
waits for nobody else. The commands take turns with it.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack

from benchmarks.figures import Row, percentile
from benchmarks.pipeline import COMPOSED, running
from benchmarks.processes import ROOT, ProgramFailed, environment, started

BY_HAND = "a script by hand"
A_SECOND = "a second"
ALL = "every answer"
_PATIENCE_S = 60.0
_ASK_BY_HAND = ("-m", "benchmarks.programs.state_by_hand")
#: Each leaves the system as the next one expects it.
COMMANDS = (
    "ps",
    "ps pipeline",
    "lifecycle nodes",
    "lifecycle get planner",
    "lifecycle get arm",
    "lifecycle list /planning/planner",
    "lifecycle set planner deactivate",
    "lifecycle set planner activate",
    "lifecycle set arm configure",
    "lifecycle set arm cleanup",
    "pause pipeline",
    "resume pipeline",
    "reset pipeline",
    "up pipeline",
)


def measure(*, long: bool) -> list[Row]:
    """Let the commands take turns. Raises ProgramFailed when one fails."""
    domain = environment()
    with ExitStack() as stack:
        stack.enter_context(running(COMPOSED, domain))
        stack.enter_context(started("lifecycle_node_by_hand", variables=domain))
        _wait_for_both(domain)
        turns = [_turn(domain) for _ in range(60 if long else 8)]
    theirs = tuple(turn[BY_HAND] for turn in turns)
    answers = {name: tuple(turn[name] for turn in turns) for name in COMMANDS}
    rows = [
        Row(f"compose {name}", "wall ms", BY_HAND, ours, theirs) for name, ours in answers.items()
    ]
    every = [answer for ours in answers.values() for answer in ours]
    return rows + [
        Row(f"{ALL}, p{100 * share:g}", "wall ms", A_SECOND, (percentile(every, share),), (1000.0,))
        for share in (0.5, 0.9, 0.99)
    ]


def _turn(domain: Mapping[str, str]) -> dict[str, float]:
    ways = {BY_HAND: _ASK_BY_HAND} | {name: ("-m", "composer", *name.split()) for name in COMMANDS}
    return {name: 1000.0 * _time_s(arguments, domain) for name, arguments in ways.items()}


def _time_s(arguments: Sequence[str], domain: Mapping[str, str]) -> float:
    start_s = time.perf_counter()
    done = _run(arguments, domain)
    took_s = time.perf_counter() - start_s
    if done.returncode != 0:
        raise ProgramFailed(f"{' '.join(arguments)}: {done.stdout}{done.stderr}")
    return took_s


def _run(arguments: Sequence[str], domain: Mapping[str, str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=ROOT,
        env=domain,
        capture_output=True,
        text=True,
        timeout=_PATIENCE_S,
        check=False,
    )


def _wait_for_both(domain: Mapping[str, str]) -> None:
    until_s = time.monotonic() + _PATIENCE_S
    while "/arm" not in (nodes := _run(("-m", "composer", "lifecycle", "nodes"), domain).stdout):
        if time.monotonic() > until_s:
            raise ProgramFailed(f"the node by hand did not come up; there are: {nodes}")
