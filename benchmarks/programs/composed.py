"""The system under measurement, as the composer runs it: from a YAML file, by its own host."""

from __future__ import annotations

import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import yaml

# What both sides import is imported before the clock starts.
from benchmarks.programs import behaviors
from benchmarks.programs.work import (
    KICK_PERIOD_S,
    Task,
    hand_over,
    measure,
    task_from_arguments,
    topic,
)
from composer.loading import load
from composer.plan import bring_up, tear_down
from composer.runtime.events import BroughtUp, Event
from composer.runtime.host import Host


def system_tree(task: Task) -> dict[str, Any]:
    """Return the system file: a ring of relays, the first of which has a timer."""
    nodes = {f"relay_{index}": _relay(task, index) for index in range(task.nodes)}
    return {
        "system": "ring",
        "executors": {"chosen": {"kind": task.executor}},
        "nodes": nodes,
    }


def main() -> None:
    """Bring the system up, measure, tell."""
    task = task_from_arguments()
    up = threading.Event()

    def listen(event: Event) -> None:
        if isinstance(event, BroughtUp):
            up.set()

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "ring.yaml")
        path.write_text(yaml.safe_dump(system_tree(task), sort_keys=False), encoding="utf-8")
        started_s = time.perf_counter()
        loading = load(path)
        if loading.system is None or not loading.runnable:
            sys.exit("; ".join(str(finding) for finding in loading.diagnostics))
        system = loading.system
        host = Host(system, bring_up(system), tear_down(system), report=listen)
        threading.Thread(target=host.run, daemon=True).start()
        if not up.wait(120.0):
            sys.exit("the system did not come up")
        figures = measure(task, started_s)
    hand_over(figures)


def _relay(task: Task, index: int) -> dict[str, Any]:
    relay: dict[str, Any] = {
        "behavior": _name(behaviors.Relay),
        "executor": "chosen",
        "subscriptions": {
            "input": {"type": "std_msgs/msg/String", "topic": topic(index, task.nodes)}
        },
        "publishers": {
            "output": {"type": "std_msgs/msg/String", "topic": topic(index + 1, task.nodes)}
        },
    }
    if index == 0 and task.timer_hz is None:
        relay["behavior"] = _name(behaviors.Starter)
        relay["timers"] = {"kick": {"period_ms": KICK_PERIOD_S * 1000.0}}
    elif index == 0:
        relay["behavior"] = _name(behaviors.Ticker)
        relay["timers"] = {"tick": {"rate_hz": task.timer_hz}}
    return relay


def _name(behavior: type[Any]) -> str:
    return f"{behavior.__module__}:{behavior.__name__}"


if __name__ == "__main__":
    main()
