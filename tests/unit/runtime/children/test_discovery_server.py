"""What a process knows of the discovery server of an earlier one, and when a server is idle."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from composer.runtime.children.discovery_server import ServerRecord, has_work
from tests.unit.support.waiting import wait_until

IDENTITY = (0, "127.0.0.1", 11811)
OTHER = (
    "from composer.runtime.children.discovery_server import ServerRecord as R; r = R{}; print({})"
)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path / f"ros2-composer-{os.geteuid()}"


def in_another_process(expression: str) -> str:
    """Return the value of an expression of ``r``, a record of another process, which then ends."""
    command = [sys.executable, "-c", OTHER.format(IDENTITY, expression)]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


def test_a_server_is_lost_with_its_process(folder: Path) -> None:
    assert in_another_process("r.is_lost") == "False"
    in_another_process("r.set_running()")
    record = ServerRecord(*IDENTITY)
    assert record.is_lost
    assert not ServerRecord(1, *IDENTITY[1:]).is_lost  # another identity
    record.set_running()
    assert in_another_process("(r.is_held_elsewhere, r.is_lost)") == "(True, False)"
    record.set_ended()
    record.close()
    assert in_another_process("(r.is_held_elsewhere, r.is_lost)") == "(False, False)"


def test_a_restart_of_the_computer_is_long_enough(folder: Path) -> None:
    in_another_process("r.set_running()")
    (file,) = folder.iterdir()
    file.write_text("4b0c6b8e-3a0e-4a58-9c2b-1f6b3f3d2a11\n")
    assert not ServerRecord(*IDENTITY).is_lost


def test_without_a_safe_folder_nothing_is_recorded(folder: Path) -> None:
    folder.mkdir()
    folder.chmod(0o777)
    record = ServerRecord(*IDENTITY)
    record.set_running()
    assert not record.is_lost
    assert not record.is_held_elsewhere
    assert list(folder.iterdir()) == []


def test_a_process_has_work_until_it_waits_or_has_ended() -> None:
    script = "read line; while [ ! -e /nowhere ]; do :; done"
    with subprocess.Popen(["/bin/sh", "-c", script], stdin=subprocess.PIPE) as process:
        try:
            wait_until(lambda: not has_work(process.pid), "its wait")
            assert process.stdin is not None
            process.stdin.write(b"\n")
            process.stdin.flush()
            wait_until(lambda: has_work(process.pid), "its work")
        finally:
            process.kill()
    assert not has_work(process.pid)
