"""A pytest plugin with which the example systems run over three processes in all tests."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from composer.loading import load
from tests.ros.support import system_process

FOLDER = "systems"


@pytest.fixture(autouse=True)
def split_examples(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let ``RunningSystem`` run copies of the example systems with ``processes``."""
    original = system_process.RunningSystem.__init__

    def init(self: system_process.RunningSystem, system: str, *options: str) -> None:
        name = Path(system).name
        is_example = Path(system) == Path(FOLDER, name)
        original(self, str(_split(name, tmp_path)) if is_example else system, *options)

    monkeypatch.setattr(system_process.RunningSystem, "__init__", init)


def _split(name: str, folder: Path) -> Path:
    """Return a copy of a system, with its nodes in turn in two processes and the first one."""
    for file in (system_process.REPOSITORY / FOLDER).glob("*.yaml"):  # with those that it includes
        (folder / file.name).write_bytes(file.read_bytes())
    path = folder / name
    system = load(path).system
    assert system is not None
    nodes = [node.name.value for node in system.nodes]
    parts = {"second": nodes[0::3], "third": nodes[1::3]}
    processes = {process: {"nodes": listed} for process, listed in parts.items() if listed}
    with path.open("a", encoding="utf-8") as file:
        file.write(f"processes: {json.dumps(processes)}\n")
    return path
