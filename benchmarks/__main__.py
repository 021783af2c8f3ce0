"""Run the benchmarks, print their tables and write the results."""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
import sysconfig
import time
import traceback
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from benchmarks import (
    dashboard,
    large_systems,
    live_commands,
    others,
    page,
    pipeline,
    plot,
    recording,
    several_processes,
    soak,
    start_up,
    systems,
    targets,
    validation,
    virtual_time,
)
from benchmarks.figures import Row, as_json, table

RESULTS = Path(__file__).parent / "results"
BENCHMARKS: dict[str, tuple[str, Callable[..., list[Row]]]] = {
    "commands": ("wall time of commands without a running system", start_up.measure),
    "live": ("wall time of commands on a running system", live_commands.measure),
    "validation": ("scaling of compose validate with the size of a system", validation.measure),
    "virtual": ("wall time of scenarios in virtual time", virtual_time.measure),
    "pipeline": ("CPU of systems/pipeline.yaml", pipeline.measure),
    "ring": ("CPU per message at full speed, start-up time and memory of N nodes", systems.ring),
    "growth": ("CPU per message with 300 nodes compared to 10", systems.growth),
    "streams": ("CPU per message at a fixed rate, in chains and stars", systems.streams),
    "hops": ("latency between two nodes", systems.hops),
    "large": ("start-up, memory and shutdown of N idle nodes", large_systems.measure),
    "timers": ("jitter of a timer", systems.timers),
    "calls": ("services and actions", systems.calls),
    "hosted": ("a talker and a listener of unmodified rclpy classes", systems.hosted),
    "external": ("messages between processes through DDS", systems.external),
    "others": (
        "the ring with Zenoh, ezmsg and dora, which are installed on the first run",
        others.measure,
    ),
    "dashboard": ("cost of the dashboard for a running system", dashboard.measure),
    "processes": ("systems split over several processes", several_processes.measure),
    "page": (
        "the page of the dashboard with a hundred nodes, in a headless Chromium",
        page.measure,
    ),
    "recording": ("cost of recording, and speed of a replay", recording.measure),
    "soak": ("memory usage under a long load", soak.measure),
    "tracing": ("cost of recording callback timings", systems.tracing),
}


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="benchmarks to run (default: all)")
    parser.add_argument("--list", action="store_true", help="list the benchmarks and exit")
    parser.add_argument("--long", action="store_true", help="run more rounds and sizes, for longer")
    options = parser.parse_args()
    if options.list:
        for name, (purpose, _) in BENCHMARKS.items():
            print(f"{name:<10} {purpose}")
        return
    unknown = sorted(set(options.names) - set(BENCHMARKS))
    if unknown:
        parser.error(f"unknown benchmark: {', '.join(unknown)}; available: {', '.join(BENCHMARKS)}")
    _run(options.names or list(BENCHMARKS), long=options.long)


def _run(names: list[str], *, long: bool) -> None:
    load_before = os.getloadavg()[0]
    began_s = time.monotonic()
    rows: list[Row] = []
    failed: list[str] = []
    for name in names:
        purpose, measure = BENCHMARKS[name]
        print(f"==> {name}: {purpose}", flush=True)
        try:
            measured = measure(long=long)
        except Exception:  # the others are still worth their time
            print(traceback.format_exc(), flush=True)
            failed.append(name)
            continue
        print(table(measured), end="\n\n", flush=True)  # in case the run is interrupted
        rows += measured
    if reached := targets.table(rows):
        print(reached, end="\n\n")
    print("Medians over rounds. Ratio: composer / baseline in one round; below 1 is better.")
    print(f"System load: {load_before:.1f} before, {os.getloadavg()[0]:.1f} after;", end=" ")
    print(f"{os.cpu_count()} processors, {time.monotonic() - began_s:.0f} s.")
    path = _write(rows, load_before, long=long)
    chart = path.with_suffix(".svg")
    chart.write_text(plot.chart(rows), encoding="utf-8")
    print(f"Results: {path}, chart of the ratios: {chart}")
    if failed:
        sys.exit(f"Failed: {', '.join(failed)}")


def _write(rows: list[Row], load_before: float, *, long: bool) -> Path:
    now = datetime.now(UTC)
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"{now:%Y%m%dT%H%M%SZ}.json"
    content = {
        "time": now.isoformat(timespec="seconds"),
        "python": platform.python_version(),
        "python build options": sysconfig.get_config_var("CONFIG_ARGS"),
        "processors": os.cpu_count(),
        "load": [load_before, os.getloadavg()[0]],
        "long": long,
        "rows": as_json(rows),
    }
    path.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    return path


if __name__ == "__main__":
    main()
