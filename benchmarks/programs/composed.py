"""The measured system, run by the composer from a YAML file."""

from __future__ import annotations

import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import yaml

# Imported before the measurement starts, as in the hand-written program.
from benchmarks.programs import behaviors, node_classes
from benchmarks.programs.payloads import TYPES
from benchmarks.programs.task import Place, Task, places, task_from_arguments, topic
from benchmarks.programs.work import KICK_PERIOD_S, measure, print_result
from composer.loading import load
from composer.plan import bring_up, tear_down
from composer.runtime.host import Host
from composer.runtime.host_options import HostOptions
from composer.runtime.supervision.events import BroughtUp, Event

_KICK = {"kick": {"period_ms": KICK_PERIOD_S * 1000.0}}
_TRIGGER = {"trigger": {"type": "std_srvs/srv/Trigger", "service": "/trigger"}}
_GO = {"go": {"type": "composer_interfaces/action/Navigate", "action": "/go"}}


def system_tree(task: Task) -> dict[str, Any]:
    """Return the content of the system file."""
    if task.shape == "pair":
        return _pair(task)
    tree: dict[str, Any] = {
        "system": "measured" if task.part is None else f"measured_{task.part}",
        "executors": {"chosen": {"kind": task.executor}},
        "nodes": {f"node_{place.index}": _node(task, place) for place in places(task)},
    }
    if task.split:
        _, *others = tree["nodes"]
        tree["processes"] = {f"of_{name}": {"nodes": [name]} for name in others}
        for node in tree["nodes"].values():
            del node["executor"]
    return tree


def main() -> None:
    """Bring the system up, measure, and print the result."""
    task = task_from_arguments()
    behaviors.TASKS.append(task)
    node_classes.TASKS.append(task)
    up = threading.Event()

    def on_event(event: Event) -> None:
        if isinstance(event, BroughtUp):
            up.set()

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "measured.yaml")
        path.write_text(yaml.safe_dump(system_tree(task), sort_keys=False), encoding="utf-8")
        started_s = time.perf_counter()
        loading = load(path)
        if loading.system is None or not loading.is_runnable:
            sys.exit("; ".join(str(item) for item in loading.diagnostics))
        system = loading.system
        member = (sys.executable, "-m", "composer", "run", str(path))
        options = HostOptions(tracing=task.tracing, member_command=member if task.split else ())
        host = Host(system, bring_up(system), tear_down(system), options, report=on_event)
        threading.Thread(target=host.run, daemon=True).start()
        if not up.wait(120.0):
            sys.exit("the system did not come up")
        figures = measure(task, started_s)
    print_result(figures)


def _pair(task: Task) -> dict[str, Any]:
    """Return a system of two hosted classes."""
    port = {"type": TYPES[task.message], "topic": topic(1)}
    module = node_classes.__name__
    return {
        "system": "measured",
        "nodes": {
            "talker": {"class": f"{module}:Talker", "publishers": {"output": port}},
            "listener": {"class": f"{module}:Listener", "subscriptions": {"input": port}},
        },
    }


def _node(task: Task, place: Place) -> dict[str, Any]:
    behavior, more = _part(task, place)
    node: dict[str, Any] = {
        "behavior": f"{behavior.__module__}:{behavior.__name__}",
        "executor": "chosen",
    }
    port = {"type": TYPES[task.message], "external": task.part is not None}
    if place.input_topic is not None and behavior is not behaviors.Source:
        node["subscriptions"] = {"input": {**port, "topic": place.input_topic}}
    if place.output_topic is not None:
        node["publishers"] = {"output": {**port, "topic": place.output_topic}}
    return node | more


def _part(task: Task, place: Place) -> tuple[type[Any], dict[str, Any]]:
    """Return the behavior of a node, and its keys other than the input and output ports."""
    source = (behaviors.Source, {"timers": {"tick": {"rate_hz": task.rate_hz}}})
    parts: dict[tuple[str, int], tuple[type[Any], dict[str, Any]]] = {
        ("ring", 0): (behaviors.Starter, {"timers": _KICK}),
        ("chain", 0): source,
        ("star", 0): source,
        ("hop", 0): source,
        ("hop", 1): (behaviors.Meter, {}),
        ("timer", 0): (behaviors.Ticker, {"timers": {"tick": {"rate_hz": task.rate_hz}}}),
        ("service", 0): (behaviors.Caller, {"timers": _KICK, "clients": _TRIGGER}),
        ("service", 1): (behaviors.Responder, {"services": _TRIGGER}),
        ("action", 0): (behaviors.Sender, {"timers": _KICK, "action_clients": _GO}),
        ("action", 1): (behaviors.Worker, {"action_servers": _GO}),
    }
    passing = behaviors.Listener if place.output_topic is None else behaviors.Relay
    return parts.get((task.shape, place.index), (passing, {}))


if __name__ == "__main__":
    main()
