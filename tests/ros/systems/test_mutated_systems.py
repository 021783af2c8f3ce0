"""What validates comes up: mutations of the example systems, each run for half a second."""

from __future__ import annotations

import copy
import json
import random
import time
from collections.abc import Iterator
from typing import Any

import pytest

from composer.base.folders import systems_folder
from composer.language.document import read_document
from composer.language.tree import plain
from composer.loading import load_bytes
from composer.model import System
from composer.runtime.host_options import HostOptions
from composer.runtime.supervision.events import BroughtUp
from tests.ros.support.in_process import RunningSystem, wait_until

BATCHES, BATCH = 10, 20
RUNS_S = 0.5
#: Warnings of what fails if the code gets there.
FORETOLD = ("elements, not ", "element, not ")
#: Of the examples, those that need nothing else, and whose nodes are to come up.
NAMES = (
    "executors",
    "navigation",
    "pipeline",
    "qos_patterns",
    "robot",
    "toolbox",
    "talker_listener",
)
TREES = [read_document(systems_folder() / f"{name}.yaml")[0] for name in NAMES]
CONTENTS = [plain(tree) for tree in TREES if tree is not None]
INTERFACES = load_bytes(b"system: a\n", systems_folder(), shown="a.yaml").interfaces


def containers(part: Any) -> Iterator[Any]:
    """Yield the maps and lists of a file that are not empty."""
    inner = list(part.values()) if isinstance(part, dict) else part
    if isinstance(inner, list):
        if inner:
            yield part
        for item in inner:
            yield from containers(item)


def mutate(content: Any, chance: random.Random) -> None:
    """Remove an entry, shorten a list, change a number or flip a switch."""
    places = [*containers(content)]
    if not places:
        return
    container = chance.choice(places)
    key = chance.choice([*container] if isinstance(container, dict) else range(len(container)))
    match container[key]:
        case bool(value):
            container[key] = not value
        case int(value) | float(value):
            container[key] = type(value)(value * chance.choice((0, 0.01, 0.5, 2, 100, -1)))
        case list(items) if items and chance.random() < 0.7:
            del items[chance.randrange(len(items)) :]
        case _:
            del container[key]


def valid_systems(chance: random.Random) -> Iterator[tuple[Any, System, str]]:
    """Yield mutated systems without errors: the content, the system, and the warnings."""
    while True:
        content = copy.deepcopy(chance.choice(CONTENTS))
        for _ in range(chance.randint(1, 4)):
            mutate(content, chance)
        data = json.dumps(content).encode()
        result = load_bytes(data, systems_folder(), shown="it.yaml", interfaces=INTERFACES)
        if result.is_runnable and result.system is not None and result.system.nodes:
            yield content, result.system, "\n".join(item.message for item in result.diagnostics)


def problem_of(system: System) -> str | None:
    """Run a system; return all that happened unless it came up and ended in order."""
    running = RunningSystem(system, HostOptions(stop_within_s=10.0), None)
    try:
        wait_until(lambda: running.reported(BroughtUp) or running.has_ended(), "bring-up")
        until_s = time.monotonic() + RUNS_S
        while not running.has_ended() and time.monotonic() < until_s:
            time.sleep(0.01)
    finally:
        outcome = running.stop()
    ups = running.reported(BroughtUp)
    if ups and ups[0].is_complete and not outcome.exit_code:
        return None
    return "\n".join([str(outcome), *map(str, running.events)])


@pytest.mark.soak
@pytest.mark.timeout(900)
@pytest.mark.parametrize("batch", range(BATCHES))
def test_what_validates_comes_up(batch: int) -> None:
    systems = valid_systems(random.Random(batch))
    failed = []
    for _ in range(BATCH):
        content, system, warnings = next(systems)
        problem = problem_of(system)
        if problem is not None and not any(text in warnings for text in FORETOLD):
            failed.append(f"{json.dumps(content)}\n{warnings}\n{problem}")
    assert not failed, "\n\n".join(failed)
