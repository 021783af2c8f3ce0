"""Dependents go down before what they depend on, over processes and within each of them."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from composer.runtime.process.instance_lock import is_held
from tests.ros.support.commands import code_of_end
from tests.ros.support.in_process import wait_until
from tests.ros.support.system_process import RunningSystem

#: Each node depends on the one before it; the letter is its process, h the coordinating one.
CHAIN = ("a1", "a2", "a3", "b4", "a5", "h6", "b7", "b8", "a9")
ATTEMPTS = 3
BEHAVIOR = """
import os
from composer.behavior import Behavior

class Recorder(Behavior):
    def record(self, transition):
        line = f"{transition} {self.name}\\n".encode()
        descriptor = os.open(os.environ["RECORD"], os.O_WRONLY | os.O_APPEND | os.O_CREAT)
        os.write(descriptor, line)
        os.close(descriptor)

    async def on_deactivate(self):
        await self.clock.sleep(0.01)  # a node that does not wait for it is recorded first
        self.record("deactivate")

    async def on_shutdown(self):
        await self.clock.sleep(0.01)
        self.record("shutdown")
"""


def write_system(folder: Path) -> Path:
    lines = ["system: chain", "processes: {a: {nodes: ['a*']}, b: {nodes: ['b*']}}", "nodes:"]
    for index, name in enumerate(CHAIN):
        needs = f", lifecycle: {{depends_on: [{CHAIN[index - 1]}]}}" if index else ""
        lines.append(f"  {name}: {{behavior: 'recorder:Recorder'{needs}}}")
    (folder / "recorder.py").write_text(BEHAVIOR, encoding="utf-8")
    path = folder / "chain.yaml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def recorded(folder: Path, transition: str) -> Sequence[str]:
    lines = (folder / "record").read_text(encoding="ascii").splitlines()
    return [line.split("/")[1] for line in lines if line.split()[0] == transition]


def test_a_chain_over_processes_goes_down_in_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    record = tmp_path / "record"
    monkeypatch.setenv("RECORD", str(record))
    path = write_system(tmp_path)

    def goes_down_in_time() -> bool:
        record.unlink(missing_ok=True)
        with RunningSystem(str(path)) as system:
            system.wait_for("9 of 9 nodes active")
            code, _ = system.stop(signal.SIGTERM)
            output = system.output
        assert code == code_of_end(output), output
        if len(re.findall(r"^/\w\d +finalized ", output, re.MULTILINE)) < len(CHAIN):
            return False
        assert recorded(tmp_path, "deactivate") == list(reversed(CHAIN))
        assert recorded(tmp_path, "shutdown") == list(reversed(CHAIN))
        return code == 0

    # The machine may not run one of the processes for a moment: the system does not wait for it.
    assert any(goes_down_in_time() for _ in range(ATTEMPTS))


def test_a_process_that_ends_by_itself_takes_its_nodes_down_in_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RECORD", str(tmp_path / "record"))
    path = write_system(tmp_path)
    command = [sys.executable, "-m", "composer", "run", str(path), "--process", "a"]
    member = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    try:
        wait_until(lambda: is_held("/chain/a"), "the process")
        with RunningSystem(str(path)) as system:
            system.wait_for("9 of 9 nodes active")
            system.stop(signal.SIGKILL)
            member.send_signal(signal.SIGINT)
            assert member.wait(60) == 0
    finally:
        member.kill()
        member.wait()
    own = [name for name in reversed(CHAIN) if name.startswith("a")]
    down = [name for name in recorded(tmp_path, "shutdown") if name.startswith("a")]
    assert down == own
