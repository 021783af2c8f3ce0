"""The ring of nodes with other middlewares that have Python packages on PyPI.

Zenoh and ezmsg run in one process, like the composer. dora runs one process per node, so it is
compared with the composer in one process and with one process per node.

The packages are installed into a separate environment on the first run. Packages that cannot be
installed are shown as failed.
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
from benchmarks.rounds import COMPOSED, Case, run_rounds
from benchmarks.systems import CPU, cpu_us

FOLDER = Path(__file__).parent / "results" / "others"
DORA = "dora"
#: Name, packages to install, and program.
OTHERS = (
    ("Zenoh", ("eclipse-zenoh",), "zenoh_ring"),
    ("ezmsg", ("ezmsg",), "ezmsg_ring"),
    (DORA, ("dora-rs", "dora-rs-cli"), "dora_ring"),
)
_INSTALL_WITHIN_S, _RUN_WITHIN_S = 300.0, 30.0
_ROS_VARIABLES = (
    "AMENT_PREFIX_PATH",
    "LD_LIBRARY_PATH",
    "PYTHONPATH",
    "_ROS_WHEELS_BOOTSTRAP_COMPLETE",
)


def measure(*, long: bool) -> list[Row]:
    """Measure all of them alternately. Raises ProgramFailed if the composer fails."""
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
        *(Row(ring, CPU, name, tuple(together), tuple(values)) for name, values in theirs.items()),
        Row(f"{ring}, one process per node", CPU, DORA, tuple(apart), tuple(theirs[DORA])),
    ]


def _ours(case: Case) -> float | None:
    (result,) = run_rounds((COMPOSED,), case)[COMPOSED]
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
    """Return our environment without ROS: its libraries are for another Python."""
    return {name: value for name, value in os.environ.items() if name not in _ROS_VARIABLES}
