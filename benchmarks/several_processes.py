"""Systems split over several processes, compared with one process or with hand-written programs."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

from benchmarks.figures import Row
from benchmarks.pipeline import Side, cpu_s, read, running
from benchmarks.processes import ROOT, ProgramFailed, environment
from benchmarks.rounds import COMPOSED, EVENTS, SINGLE, Case, rows, run_rounds
from benchmarks.systems import interval_us

#: The baseline of two rows: the same system without ``processes``.
ONE_PROCESS = "one process"
#: The case of the target for computing nodes: time per result, so that less is better.
COMPUTING = "two computing nodes, two processes"
LATENCY = "ring, 2 processes of a system"
_LEAN = dict.fromkeys(("parameters", "rosout", "type_description", "lifecycle_services"), False)
_TIMEOUT_S = 600.0
_BEHAVIORS = "benchmarks.programs.workers"  # its imports need ROS
_RATE = re.compile(r"results per second: ([0-9.]+)")
_FINALIZED = re.compile(r"^/node_\S+ +finalized ", re.MULTILINE)
_KIB_PER_MB = 1000.0 / 1.024


def measure(*, long: bool) -> list[Row]:
    """Measure all. Raises ProgramFailed."""
    return [*_computing(long=long), *_latency(long=long), *_many_nodes(long=long)]


def _computing(*, long: bool) -> list[Row]:
    rounds, seconds = (7, 10.0) if long else (3, 5.0)
    figures: dict[bool, list[float]] = {True: [], False: []}
    for turn in range(rounds):
        for is_split in (True, False) if turn % 2 == 0 else (False, True):
            figures[is_split].append(1000.0 / _results_hz(seconds, is_split=is_split))
    return [Row(COMPUTING, "ms/result", ONE_PROCESS, tuple(figures[True]), tuple(figures[False]))]


def _results_hz(seconds: float, *, is_split: bool) -> float:
    worker = {"timers": {"tick": {"rate_hz": 10_000}}, "behavior": f"{_BEHAVIORS}:Worker"}
    tree: dict[str, Any] = {"system": "computing", "nodes": {"near": worker, "far": worker}}
    if is_split:
        tree["processes"] = {"second": {"nodes": ["far"]}}
    with _file(tree) as path:
        command = (sys.executable, "-m", "composer", "run", str(path), "--for", f"{seconds:g}")
        done = subprocess.run(
            command,
            cwd=ROOT,
            env={**environment(), "PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            timeout=_TIMEOUT_S,
            check=False,
        )
    text = done.stdout + done.stderr
    found = [float(rate) for rate in _RATE.findall(text)]
    if len(found) != len(tree["nodes"]):
        raise ProgramFailed(f"no result: {text[-500:]}")
    return sum(found)


def _latency(*, long: bool) -> list[Row]:
    case = Case("ring", 2, 3.0 if long else 2.0, 9 if long else 5, apart=True, is_one_system=True)
    turns = run_rounds((COMPOSED, SINGLE, EVENTS), case)
    return rows(LATENCY, "us/message", turns, interval_us)


def _many_nodes(*, long: bool) -> list[Row]:
    nodes, processes, rounds = (1000, 10, 3) if long else (300, 3, 1)
    ours: dict[tuple[str, str], list[float]] = {}
    theirs: dict[tuple[str, str], list[float]] = {}
    for turn in range(rounds):
        sides = [(ours, processes), (theirs, 1)]
        for figures, count in sides if turn % 2 == 0 else reversed(sides):
            for name, value in _of_many(nodes, count).items():
                figures.setdefault(name, []).append(value)
    return [
        Row(
            f"{what}, N={nodes}, {processes} processes",
            unit,
            ONE_PROCESS,
            tuple(values),
            tuple(theirs[what, unit]),
        )
        for (what, unit), values in ours.items()
    ]


def _of_many(nodes: int, processes: int) -> dict[tuple[str, str], float]:
    """Return the figures of a system of idle nodes without introspection."""
    share = nodes // processes
    tree: dict[str, Any] = {
        "system": "large",
        "introspection": _LEAN,
        "processes": {
            f"part_{part}": {"nodes": [f"node_{part}_*"]} for part in range(1, processes)
        },
        "nodes": {
            f"node_{part}_{index}": {} for part in range(processes) for index in range(share)
        },
    }
    if processes == 1:
        del tree["processes"]
    variables = environment()
    with _file(tree) as path:
        side = Side(("-m", "composer", "run", str(path)), f"{nodes} of {nodes} nodes active", _RATE)
        began_s = time.perf_counter()
        with running(side, variables, timeout_s=_TIMEOUT_S) as (process, output):
            figures = {("start", "s"): time.perf_counter() - began_s}
            pids = [process.pid, *_descendants(process.pid)]
            figures["start", "CPU s"] = sum(cpu_s(pid) for pid in pids)
            figures["memory", "MB"] = sum(_memory_mb(pid) for pid in pids)
            figures["ps", "s"] = _command_s("ps", "large", variables=variables)
            began_s = time.perf_counter()
            process.send_signal(signal.SIGINT)
            if process.wait(_TIMEOUT_S) not in (0, 1):  # 1: not all nodes in time
                raise ProgramFailed(f"exit code {process.returncode}: {read(output)[-500:]}")
            figures["stop", "s"] = time.perf_counter() - began_s
            figures["down at the end", "% of nodes"] = _share_down(read(output), nodes)
    return figures


def _share_down(output: str, nodes: int) -> float:
    return 100.0 * len(_FINALIZED.findall(output)) / nodes


def _command_s(*words: str, variables: Mapping[str, str]) -> float:
    began_s = time.perf_counter()
    command: Sequence[str] = (sys.executable, "-m", "composer", *words)
    done = subprocess.run(
        command, cwd=ROOT, env=variables, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise ProgramFailed(f"{' '.join(words)}: {done.stderr[-500:]}")
    return time.perf_counter() - began_s


def _descendants(pid: int) -> Iterator[int]:
    for thread in Path(f"/proc/{pid}/task").iterdir():
        for child in (thread / "children").read_text(encoding="ascii").split():
            yield int(child)
            yield from _descendants(int(child))


def _memory_mb(pid: int) -> float:
    """Return the memory of a process; each of n processes counts 1/n of what they share."""
    for line in Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii").splitlines():
        if line.startswith("Pss:"):
            return int(line.split()[1]) / _KIB_PER_MB
    raise ProgramFailed("no memory is reported")


@contextmanager
def _file(tree: Mapping[str, Any]) -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "measured.yaml")
        path.write_text(yaml.safe_dump(tree, sort_keys=False), encoding="utf-8")
        yield path
