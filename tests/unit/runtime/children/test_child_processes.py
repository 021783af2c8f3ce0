"""Child processes: their output, their end, and that none is left behind. No ROS."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import pytest

from composer.runtime.children import launcher
from composer.runtime.children.child_processes import (
    Child,
    ChildProcesses,
    Command,
    StartFailed,
    kill_descendants,
)
from composer.runtime.executors.tracebacks import format_stack, stacks_of
from tests.unit.support.waiting import PATIENCE_S, is_alive, status_of, wait_until

MARK = "COMPOSER_TEST_MARK"
#: A composer with three children: a polite one, one that ignores everything but SIGKILL, and one
#: with a grandchild that has left the process group.
COMPOSER = """
import signal, sys, time
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # which these tests may have been started to ignore
from composer.runtime.children.child_processes import ChildProcesses, Command
children = ChildProcesses()
mark = {MARK: sys.argv[1]}
polite = "echo polite; exec sleep 60"
stubborn = "trap '' INT TERM HUP; echo stubborn; while true; do sleep 0.1; done"
daemon = "setsid sleep 60 & echo daemon; exec sleep 60"
for script in (polite, stubborn, daemon):
    children.start(
        Command(["sh", "-c", script], mark), lambda text, _: print(text, flush=True)
    )
time.sleep(60)
""".replace("MARK", repr(MARK))


def marked(mark: str) -> list[int]:
    """Return the processes with a mark in their environment."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if f"{MARK}={mark}\0".encode() in (folder / "environ").read_bytes():
                found.append(int(folder.name))
    return list(filter(is_alive, found))


@pytest.fixture
def children() -> Iterator[ChildProcesses]:
    processes = ChildProcesses()
    try:
        yield processes
    finally:
        processes.close()


@contextmanager
def composer(mark: str) -> Iterator[subprocess.Popen[str]]:
    """Run a composer with three children, and wait for them."""
    process = subprocess.Popen(
        [sys.executable, "-c", COMPOSER, mark], stdout=subprocess.PIPE, text=True
    )
    try:
        assert process.stdout is not None
        said = {process.stdout.readline().strip() for _ in range(3)}
        assert said == {"polite", "stubborn", "daemon"}
        yield process
    finally:
        process.kill()
        process.wait()


def start(children: ChildProcesses, script: str, lines: list[tuple[str, bool]]) -> Child:
    return children.start(
        Command(["sh", "-c", script]), lambda text, is_error: lines.append((text, is_error))
    )


def kill_launcher_of(child: int) -> int:
    """Kill the process that starts the children, the parent of a child; return its id."""
    _, pid = status_of(child)
    os.kill(pid, signal.SIGKILL)
    return pid


def test_output_status_environment_folder_and_no_input(
    children: ChildProcesses, tmp_path: Path
) -> None:
    lines: list[tuple[str, bool]] = []
    script = "cat; pwd; echo $SIZE; echo error >&2; exit 3"
    command = Command(["sh", "-c", script], {"SIZE": "12"}, tmp_path)
    child = children.start(command, lambda text, is_error: lines.append((text, is_error)))
    wait_until(child.ended.done, "the end")
    assert child.ended.result() == 3
    assert [text for text, is_error in lines if not is_error] == [str(tmp_path), "12"]
    assert [text for text, is_error in lines if is_error] == ["error"]


@pytest.mark.parametrize(
    ("words", "reason"),
    [(["/nowhere/program"], "No such file"), (["/etc/passwd"], "Permission denied")],
)
def test_a_program_that_cannot_start(
    children: ChildProcesses, words: list[str], reason: str
) -> None:
    child = children.start(Command(words), lambda *_: None)
    wait_until(child.started.done, "an answer")
    with pytest.raises(StartFailed, match=reason):
        child.started.result()
    assert child.ended.cancelled()


@pytest.mark.parametrize(
    ("traps", "status", "limits_s", "least_s"),
    [
        ("trap 'exit 7' INT", 7, (PATIENCE_S, PATIENCE_S), 0.0),
        ("trap '' INT; trap 'exit 8' TERM", 8, (0.2, PATIENCE_S), 0.2),
        ("trap '' INT TERM", -9, (0.2, 0.2), 0.4),
    ],
)
def test_ends_in_order(
    children: ChildProcesses, traps: str, status: int, limits_s: tuple[float, float], least_s: float
) -> None:
    lines: list[tuple[str, bool]] = []
    child = start(children, f"{traps}; echo ready; while true; do sleep 0.01; done", lines)
    wait_until(lambda: lines, "the trap")
    began_s = time.monotonic()
    children.end(child, *limits_s)
    wait_until(child.ended.done, "the end")
    assert child.ended.result() == status
    assert time.monotonic() - began_s >= least_s


def test_the_rest_of_a_group_ends_with_its_leader(children: ChildProcesses) -> None:
    lines: list[tuple[str, bool]] = []
    child = start(children, "sleep 60 & echo $!; exec sleep 60", lines)
    wait_until(lambda: lines and child.started.done(), "the number of the grandchild")
    os.kill(child.started.result(), signal.SIGKILL)
    wait_until(child.ended.done, "the end")
    assert child.ended.result() == -9
    grandchild = Path("/proc", lines[0][0])
    wait_until(lambda: not grandchild.exists(), "the end of the grandchild")


def test_nothing_is_left_after_close(tmp_path: Path) -> None:
    children = ChildProcesses()
    folder = children.prepare()
    child = start(children, "trap '' INT TERM; while true; do sleep 0.1; done", [])
    wait_until(child.started.done, "the start")
    children.close()
    assert child.ended.done()
    assert not folder.exists()


@pytest.mark.slow
def test_no_orphan_whatever_ends_the_composer() -> None:
    numbers = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
    mark = f"{os.getpid()}-{time.monotonic_ns()}"
    with ExitStack() as stack:
        processes = [stack.enter_context(composer(mark)) for _ in numbers]
        wait_until(lambda: len(marked(mark)) >= 4 * len(numbers), "all of them")
        for process, number in zip(processes, numbers, strict=True):
            process.send_signal(number)
        for process in processes:
            process.wait(PATIENCE_S)
        wait_until(lambda: not marked(mark), "the end of all children")


def test_nothing_survives_the_launcher(children: ChildProcesses) -> None:
    folder = children.prepare()
    lines: list[tuple[str, bool]] = []
    child = start(children, "(setsid sleep 60 & echo $!); exec sleep 60", lines)
    wait_until(lambda: lines and child.started.done(), "the number of the daemon")
    kill_launcher_of(child.started.result())
    wait_until(child.ended.done, "the end")
    entries = [Path("/proc", pid) for pid in (str(child.pid), lines[0][0])]
    wait_until(lambda: not any(entry.exists() for entry in entries), "the death of both")
    assert not folder.exists()
    again = start(children, "exit 0", [])  # by a new launcher
    wait_until(again.ended.done, "the end")
    assert again.ended.result() == 0


def test_what_starts_another_program_at_the_moment_is_killed_as_well(tmp_path: Path) -> None:
    """Its environment is empty then."""
    program = tmp_path / "again"
    program.write_text('#!/bin/sh\nexec "$0"\n', encoding="utf-8")
    program.chmod(0o755)
    for _ in range(60):  # one of eleven was missed
        with subprocess.Popen([program], env={launcher.MARK: str(tmp_path)}) as process:
            try:
                kill_descendants(tmp_path)
                assert process.wait(10.0) == -signal.SIGKILL
            finally:
                process.kill()


def test_a_launcher_that_was_killed_is_closed_without_an_error(children: ChildProcesses) -> None:
    """Its end may not have been noticed yet."""
    printed, closing, closed = threading.Event(), threading.Event(), threading.Event()
    pids: list[int] = []

    def on_line(text: str, _: bool) -> None:
        pids.append(int(text))
        printed.set()
        closing.wait(PATIENCE_S)  # keeps the thread from noticing anything

    children.start(Command(["sh", "-c", "echo $$; exec sleep 60"]), on_line)
    assert printed.wait(PATIENCE_S)
    os.waitid(os.P_PID, kill_launcher_of(pids[0]), os.WEXITED | os.WNOWAIT)

    def close() -> None:
        children.close()
        closed.set()  # it has raised nothing

    def is_joining() -> bool:
        stacks = stacks_of([closer.ident or 0]).values()
        return any(".join(" in format_stack(stack) for stack in stacks)

    closer = threading.Thread(target=close)
    closer.start()
    wait_until(is_joining, "its wait")
    closing.set()
    assert closed.wait(PATIENCE_S)


def test_nothing_is_started_for_a_composer_that_is_gone(tmp_path: Path) -> None:
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    started = tmp_path / "started"
    request = {"start": 1, "command": ["touch", str(started)], "environment": {}, "folder": None}
    with Path(os.devnull).open("wb") as output:
        files = [output.fileno(), output.fileno()]
        socket.send_fds(ours, [json.dumps(request).encode()], files)
    ours.close()
    with theirs:
        command = [sys.executable, launcher.__file__, str(theirs.fileno()), str(tmp_path / "files")]
        done = subprocess.run(command, pass_fds=[theirs.fileno()], timeout=PATIENCE_S, check=False)
    assert done.returncode == 0
    assert not started.exists()
