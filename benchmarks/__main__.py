"""Run the benchmarks, print the table, write the figures."""

from __future__ import annotations

import argparse
import json
import os
import platform
import sysconfig
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from benchmarks import (
    answers,
    large_systems,
    others,
    pipeline,
    plot,
    soak,
    start_up,
    systems,
    targets,
    validation,
)
from benchmarks.figures import Row, as_json, table

RESULTS = Path(__file__).parent / "results"
BENCHMARKS: dict[str, tuple[str, Callable[..., list[Row]]]] = {
    "commands": ("wall time of commands that start nothing", start_up.measure),
    "answers": ("wall time of commands beside a running system", answers.measure),
    "validation": ("growth of compose validate with the size of a system", validation.measure),
    "pipeline": ("CPU of systems/pipeline.yaml", pipeline.measure),
    "ring": ("CPU per message as fast as it goes, start-up and memory of N nodes", systems.ring),
    "growth": ("CPU per message of 300 nodes against 10", systems.growth),
    "streams": ("CPU per message at a rate, chains and stars, small and large", systems.streams),
    "hops": ("latency from node to node", systems.hops),
    "large": ("start, memory and stop of N idle nodes", large_systems.measure),
    "timers": ("jitter of a timer", systems.timers),
    "calls": ("services and actions", systems.calls),
    "outside": ("DDS to another process", systems.outside),
    "others": ("the ring with Zenoh, ezmsg and dora, installed when first run", others.measure),
    "soak": ("a day of work in little: is memory flat?", soak.measure),
    "tracing": ("what the times of callbacks cost", systems.tracing),
}


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="which; all of them unless given")
    parser.add_argument("--list", action="store_true", help="say which there are")
    parser.add_argument("--long", action="store_true", help="more rounds, sizes and time")
    options = parser.parse_args()
    if options.list:
        for name, (purpose, _) in BENCHMARKS.items():
            print(f"{name:<10} {purpose}")
        return
    unknown = sorted(set(options.names) - set(BENCHMARKS))
    if unknown:
        parser.error(f"no such benchmark: {', '.join(unknown)}; there is {', '.join(BENCHMARKS)}")
    _run(options.names or list(BENCHMARKS), long=options.long)


def _run(names: list[str], *, long: bool) -> None:
    load_before = os.getloadavg()[0]
    began_s = time.monotonic()
    rows: list[Row] = []
    for name in names:
        purpose, measure = BENCHMARKS[name]
        print(f"==> {name}: {purpose}", flush=True)
        found = measure(long=long)
        print(table(found), end="\n\n", flush=True)  # at once: an interrupted run tells this much
        rows += found
    if judged := targets.table(rows):
        print(judged, end="\n\n")
    print("Medians of the rounds; a ratio is ours / theirs of one round, below 1 is less for ours.")
    print(
        f"Load of the machine: {load_before:.1f} before, {os.getloadavg()[0]:.1f} after;", end=" "
    )
    print(f"{os.cpu_count()} processors, {time.monotonic() - began_s:.0f} s.")
    path = _write(rows, load_before, long=long)
    picture = path.with_suffix(".svg")
    picture.write_text(plot.picture(rows), encoding="utf-8")
    print(f"Every figure: {path}, a picture of the ratios: {picture}")


def _write(rows: list[Row], load_before: float, *, long: bool) -> Path:
    now = datetime.now(UTC)
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"{now:%Y%m%dT%H%M%SZ}.json"
    content = {
        "time": now.isoformat(timespec="seconds"),
        "python": platform.python_version(),
        "python was built with": sysconfig.get_config_var("CONFIG_ARGS"),
        "processors": os.cpu_count(),
        "load": [load_before, os.getloadavg()[0]],
        "long": long,
        "rows": as_json(rows),
    }
    path.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    return path


if __name__ == "__main__":
    main()
