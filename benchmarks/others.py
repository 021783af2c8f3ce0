"""The ring of nodes with other middlewares that have a Python of their own on PyPI.

Zenoh and ezmsg are in one process, as the composer is; dora has a process for each node, so it is
held against the composer in one process, and in one for each node as well.

They are installed into an environment of the benchmark's own, when it runs for the first time. What
does not install here is shown as failed.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from benchmarks.figures import Row
from benchmarks.processes import ProgramFailed, run_program
from benchmarks.systems import CPU, cpu_us
from benchmarks.turns import COMPOSED, Case, take_turns

FOLDER = Path(__file__).parent / "results" / "others"
DORA = "dora"
#: The name, what pip is to install, and the program.
OTHERS = (
    ("Zenoh", ("eclipse-zenoh",), "zenoh_ring"),
    ("ezmsg", ("ezmsg",), "ezmsg_ring"),
    (DORA, ("dora-rs", "dora-rs-cli"), "dora_ring"),
)
_INSTALL_WITHIN_S, _RUN_WITHIN_S = 300.0, 30.0
_OF_ROS = ("AMENT_PREFIX_PATH", "LD_LIBRARY_PATH", "PYTHONPATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE")


def measure(*, long: bool) -> list[Row]:
    """Let the composer and the others take turns. Raises ProgramFailed where ours fails."""
    case = Case("ring", 10, 3.0 if long else 0.6, rounds=1)
    installed = {name: _install(*packages) for name, packages, _ in OTHERS}
    together: list[float | None] = []
    apart: list[float | None] = []
    theirs: dict[str, list[float | None]] = {name: [] for name in installed}
    for _ in range(7 if long else 3):
        together.append(_ours(case))
        apart.append(_ours(replace(case, apart=True)))
        for name, _, program in OTHERS:
            theirs[name].append(_run(program, case) if installed[name] else None)
    ring = f"ring, N={case.nodes}"
    return [
        *(Row(ring, CPU, name, tuple(together), tuple(found)) for name, found in theirs.items()),
        Row(f"{ring}, a process each", CPU, DORA, tuple(apart), tuple(theirs[DORA])),
    ]


def _ours(case: Case) -> float | None:
    (result,) = take_turns((COMPOSED,), case)[COMPOSED]
    return None if result is None else cpu_us(result)


def _run(program: str, case: Case) -> float | None:
    try:
        result = run_program(
            program,
            "alone",
            *case.arguments,
            timeout_s=_RUN_WITHIN_S,
            variables=_environment(),
            python=str(FOLDER / "bin" / "python"),
        )
    except ProgramFailed:
        return None
    return cpu_us(result)


def _install(*packages: str) -> bool:
    if not FOLDER.exists():
        _call(sys.executable, "-m", "venv", str(FOLDER))
    return _call(str(FOLDER / "bin" / "python"), "-m", "pip", "install", "--quiet", *packages)


def _call(*command: str) -> bool:
    try:
        subprocess.run(
            command,
            env=_environment(),
            check=True,
            capture_output=True,
            timeout=_INSTALL_WITHIN_S,
        )
    except (OSError, subprocess.SubprocessError):
        return False
    return True


def _environment() -> Mapping[str, str]:
    """Return ours without what leads to ROS: its libraries must not get into another Python."""
    return {name: value for name, value in os.environ.items() if name not in _OF_ROS}
