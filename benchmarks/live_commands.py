"""Wall time of commands on a running system, from the start of the process to its exit.

The ROS graph contains systems/pipeline.yaml and a separate lifecycle node. The baseline is a
hand-written script that calls one service, whose name it knows, without listing nodes. The commands
and the script run alternately.
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

HAND_WRITTEN = "hand-written script"
ONE_SECOND = "1 s"
ALL = "all commands"
_TIMEOUT_S = 60.0
_SCRIPT = ("-m", "benchmarks.programs.get_state")
#: Each command leaves the system in the state that the next one expects.
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
    "lifecycle pause pipeline",
    "lifecycle resume pipeline",
    "lifecycle reset pipeline",
    "lifecycle startup pipeline",
)


def measure(*, long: bool) -> list[Row]:
    """Measure the commands alternately. Raises ProgramFailed if one fails."""
    domain = environment()
    with ExitStack() as stack:
        stack.enter_context(running(COMPOSED, domain))
        stack.enter_context(started("lifecycle_node", variables=domain))
        _wait_for_both(domain)
        turns = [_turn(domain) for _ in range(60 if long else 8)]
    theirs = tuple(turn[HAND_WRITTEN] for turn in turns)
    times_ms = {name: tuple(turn[name] for turn in turns) for name in COMMANDS}
    rows = [
        Row(f"compose {name}", "wall ms", HAND_WRITTEN, ours, theirs)
        for name, ours in times_ms.items()
    ]
    every = [time_ms for ours in times_ms.values() for time_ms in ours]
    return rows + [
        Row(
            f"{ALL}, p{100 * share:g}",
            "wall ms",
            ONE_SECOND,
            (percentile(every, share),),
            (1000.0,),
        )
        for share in (0.5, 0.9, 0.99)
    ]


def _turn(domain: Mapping[str, str]) -> dict[str, float]:
    variants = {HAND_WRITTEN: _SCRIPT} | {
        name: ("-m", "composer", *name.split()) for name in COMMANDS
    }
    return {name: 1000.0 * _time_s(arguments, domain) for name, arguments in variants.items()}


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
        timeout=_TIMEOUT_S,
        check=False,
    )


def _wait_for_both(domain: Mapping[str, str]) -> None:
    until_s = time.monotonic() + _TIMEOUT_S
    while "/arm" not in (nodes := _run(("-m", "composer", "lifecycle", "nodes"), domain).stdout):
        if time.monotonic() > until_s:
            raise ProgramFailed(f"/arm did not come up; nodes: {nodes}")
