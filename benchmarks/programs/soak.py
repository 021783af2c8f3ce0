"""Sample the memory of a system under load."""

from __future__ import annotations

import argparse
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml
from rclpy.parameter import Parameter

from benchmarks.programs import behaviors
from benchmarks.programs.composed import system_tree
from benchmarks.programs.task import Task
from benchmarks.programs.work import COUNTS, memory_mb, print_result
from composer.loading import load
from composer.plan import bring_up, tear_down
from composer.runtime.host import Host
from composer.runtime.node.node import RunningNode
from composer.runtime.supervision.events import BroughtUp, Event

#: The total work.
MESSAGES, TIMER_CHANGES, CYCLES = 10_000_000, 10_000, 1_000
_STEPS = 100  # samples of the memory
_CYCLE = ("deactivate", "cleanup", "configure", "activate")
_TIMEOUT_S = 30.0
_MORE = {
    "ticking": {
        "parameters": {"rate_hz": {"type": "double", "default": 50.0}},
        "state": {"ticks": 0},
        "timers": {"tick": {"rate_hz": "{parameters.rate_hz}", "set": {"ticks": "{count}"}}},
    },
    "cycling": {
        "publishers": {"output": {"type": "std_msgs/msg/String", "external": True}},
        "subscriptions": {
            "input": {"type": "std_msgs/msg/String", "external": True, "log": "received"}
        },
        "services": {"trigger": {"type": "std_srvs/srv/Trigger", "log": "called"}},
        "timers": {"tick": {"rate_hz": 100, "publish": {"output": {"data": "number {count}"}}}},
    },
}


def main() -> None:
    """Bring the system up, run the load, and print the result."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--share", type=float, default=1.0)
    share = parser.parse_args().share
    task = Task("events", "ring", 3, 0.0, 100.0, "String", None, tracing=True)
    behaviors.TASKS.append(task)
    up = threading.Event()

    def on_event(event: Event) -> None:
        if isinstance(event, BroughtUp):
            up.set()

    tree = system_tree(task)
    tree["nodes"] |= _MORE
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "soak.yaml")
        path.write_text(yaml.safe_dump(tree, sort_keys=False), encoding="utf-8")
        loading = load(path)
        if loading.system is None or not loading.is_runnable:
            sys.exit("; ".join(item.message for item in loading.diagnostics))
        system = loading.system
        host = Host(system, bring_up(system), tear_down(system), report=on_event)
        threading.Thread(target=host.run, daemon=True).start()
        if not up.wait(_TIMEOUT_S):
            sys.exit("the system did not come up")
        started_s = time.monotonic()
        memory = list(_work(host._node_set.nodes, share))
    print_result(
        {
            "memory_mb": memory,
            "messages": COUNTS.delivered,
            "took_s": time.monotonic() - started_s,
        }
    )


def _work(nodes: dict[str, RunningNode], share: float) -> Iterator[float]:
    """Run all kinds of load, and yield the resident memory after each step."""
    for step in range(1, _STEPS + 1):
        for change in _due(TIMER_CHANGES * share, step):
            _set_rate(nodes["ticking"], 50.0 + change % 50)
        for _ in _due(CYCLES * share, step):
            _cycle(nodes["cycling"])
        while COUNTS.delivered < MESSAGES * share * step / _STEPS:
            time.sleep(0.01)
        yield memory_mb()


def _due(total: float, step: int) -> range:
    """Return the indices of the ``total`` operations that belong to a step."""
    return range(round(total * (step - 1) / _STEPS), round(total * step / _STEPS))


def _set_rate(node: RunningNode, rate_hz: float) -> None:
    ros = node.contexts[0].node
    done: Any = node.loop.run(
        lambda: ros.set_parameters([Parameter("rate_hz", value=rate_hz)]), _TIMEOUT_S
    )
    if not done[0].successful:
        sys.exit(f"rate_hz was not set: {done[0].reason}")


def _cycle(node: RunningNode) -> None:
    for transition in _CYCLE:
        ended = threading.Event()
        node.loop.run_task(node.lifecycle.change(transition)).add_done_callback(
            lambda _, ended=ended: ended.set()
        )
        if not ended.wait(_TIMEOUT_S):
            sys.exit(f"{transition} did not end")
    if node.state != "active":
        sys.exit(f"the node is {node.state} after a cycle")


if __name__ == "__main__":
    main()
