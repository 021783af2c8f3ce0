"""The ring of nodes with dora: a dataflow with a process per node, and a daemon."""

from __future__ import annotations

import json
import mmap
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from benchmarks.programs.task import Task, task_from_arguments
from benchmarks.programs.work import WARM_UP_S, print_result

_RELAY = Path(__file__).with_name("dora_relay.py")
_BEGINS_WITHIN_S, _ENDS_WITHIN_S = 15.0, 5.0
_POLL_PERIOD_S = 0.05


def main() -> None:
    task = task_from_arguments()
    with tempfile.TemporaryDirectory() as folder:
        counts_file = Path(folder, "counts")
        counts_file.write_bytes(bytes(8 * task.nodes))
        with counts_file.open("r+b") as file:
            counts = memoryview(mmap.mmap(file.fileno(), 0)).cast("Q")
        # JSON is valid YAML and needs no library here.
        dataflow = Path(folder, "ring.yml")
        dataflow.write_text(json.dumps(_dataflow(task, counts_file)), encoding="utf-8")
        with _running(dataflow) as daemon:
            figures = _measure(daemon, counts, task)
    print_result(figures)


def _dataflow(task: Task, counts_file: Path) -> dict[str, Any]:
    return {
        "nodes": [
            {
                "id": f"node_{index}",
                "path": str(_RELAY),
                "args": f"{index} {counts_file}",
                "inputs": {"text": f"node_{(index - 1) % task.nodes}/text"},
                "outputs": ["text"],
            }
            for index in range(task.nodes)
        ]
    }


@contextmanager
def _running(dataflow: Path) -> Iterator[int]:
    """Context manager: run the dataflow; the value is the process ID of the daemon."""
    programs = Path(sys.executable).parent
    command = [programs / "dora", "run", dataflow.name]
    variables = {**os.environ, "PATH": f"{programs}:{os.environ['PATH']}"}
    with subprocess.Popen(
        command,
        cwd=dataflow.parent,
        env=variables,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as daemon:
        try:
            yield daemon.pid
        finally:
            processes = _processes(daemon.pid)
            daemon.send_signal(signal.SIGINT)
            try:
                daemon.wait(_ENDS_WITHIN_S)
            except subprocess.TimeoutExpired:
                for process in processes:
                    with suppress(ProcessLookupError):
                        os.kill(process, signal.SIGKILL)


def _measure(daemon: int, counts: memoryview, task: Task) -> dict[str, Any]:
    until_s = time.monotonic() + _BEGINS_WITHIN_S
    while not sum(counts):
        if time.monotonic() > until_s:
            sys.exit(f"no message delivered within {_BEGINS_WITHIN_S:g} s")
        time.sleep(_POLL_PERIOD_S)
    time.sleep(WARM_UP_S)  # as in work.py
    processes = _processes(daemon)
    delivered, cpu_s, wall_s = sum(counts), _cpu_s(processes), time.perf_counter()
    time.sleep(task.seconds)
    return {
        "cpu_s": _cpu_s(processes) - cpu_s,
        "wall_s": time.perf_counter() - wall_s,
        "delivered": sum(counts) - delivered,
    }


def _processes(daemon: int) -> list[int]:
    """Return the daemon and its child processes."""
    children = Path(f"/proc/{daemon}/task").glob("*/children")
    return [daemon, *(int(child) for file in children for child in file.read_text().split())]


def _cpu_s(processes: list[int]) -> float:
    """Return the total CPU time, from the CPU clock of each process (clock_getcpuclockid(3))."""
    return sum(time.clock_gettime((~process << 3) | 2) for process in processes)


if __name__ == "__main__":
    main()
