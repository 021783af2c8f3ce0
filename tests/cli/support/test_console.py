"""Console output: only data on stdout, and a bounded queue that never delays who writes."""

from __future__ import annotations

import fcntl
import os
import socket
import subprocess
import sys
import termios
import threading
import time
from pathlib import Path

import pytest

from composer.cli.support.console import FileDescriptor, OutputQueue
from tests.cli.compose import run_python

LIMIT_S = 60.0


def note(count: int) -> str:
    return f"... {count} lines dropped: the output was blocked\n"


def queue_to(fd: int, name: str = "console") -> OutputQueue:
    return OutputQueue(FileDescriptor(fd), note, name=name)


class HeldSink:
    """Accepts everything, once it may."""

    def __init__(self) -> None:
        self.taken, self.may_write = threading.Event(), threading.Event()
        self.written = b""

    def write(self, data: bytes) -> int:
        self.taken.set()
        self.may_write.wait(LIMIT_S)
        self.written += data
        return len(data)

    def close(self) -> None:
        pass


class FullPipe:
    """A pipe that accepts nothing until it is read."""

    def __init__(self) -> None:
        self.reading, self.writing = os.pipe()
        fcntl.fcntl(self.writing, fcntl.F_SETPIPE_SZ, 4096)
        self.filling = os.write(self.writing, b"x" * 4096)

    def close_writing(self) -> None:
        os.close(self.writing)

    def read(self) -> bytes:
        """Read until the last writer has closed the pipe, without what filled it."""
        with os.fdopen(self.reading, "rb") as pipe:
            return pipe.read()[self.filling :]


def test_text_is_written_in_order() -> None:
    reading, writing = os.pipe()
    queue = queue_to(writing)
    os.close(writing)
    lines = [f"line {number} ä\n" for number in range(1000)]
    for line in lines:
        queue.put(line)
    queue.close()
    with os.fdopen(reading, encoding="utf-8") as pipe:
        assert pipe.read() == "".join(lines)


def test_the_oldest_lines_are_dropped_and_counted_while_nothing_reads() -> None:
    sink = HeldSink()
    queue = OutputQueue(sink, note, max_waiting=50)
    queue.put("first\n")
    assert sink.taken.wait(LIMIT_S)
    for number in range(100):
        queue.put(f"line {number:02}\n")
    sink.may_write.set()
    queue.close()
    first, dropped, *rest = sink.written.decode().splitlines()
    assert first == "first"
    assert dropped == "... 94 lines dropped: the output was blocked"
    assert rest == [f"line {number:02}" for number in range(94, 100)]


def test_the_end_does_not_wait_for_a_pipe_that_nothing_reads() -> None:
    pipe = FullPipe()
    queue = queue_to(pipe.writing)
    queue.put("text\n")
    closing = threading.Thread(target=queue.close)
    closing.start()
    closing.join(LIMIT_S)
    assert not closing.is_alive()
    pipe.close_writing()
    os.close(pipe.reading)


def test_the_end_waits_for_a_reader_that_was_stopped() -> None:
    pipe = FullPipe()
    queue = queue_to(pipe.writing, "stopped reader")
    pipe.close_writing()
    queue.put("text\n")
    received: list[bytes] = []
    reader = threading.Thread(target=lambda: received.append(pipe.read()))
    (writer,) = (item for item in threading.enumerate() if item.name == "stopped reader")
    waits = 0

    def join(timeout: float) -> None:
        nonlocal waits
        waits += 1
        if waits == 2:
            reader.start()
            timeout = LIMIT_S
        threading.Thread.join(writer, timeout)

    writer.join = join  # type: ignore[assignment,method-assign]
    assert queue.close()
    reader.join(LIMIT_S)
    assert received == [b"text\n"]


def test_a_closed_pipe_drops_everything() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    queue = queue_to(writing)
    os.close(writing)
    queue.put("text\n")
    queue.close()
    queue.put("more\n")


def test_lines_that_a_full_disk_refuses_are_noticed() -> None:
    with Path("/dev/full").open("w", encoding="utf-8") as full:
        queue = queue_to(full.fileno())
        queue.put("one\ntwo\n")
        queue.close()
    assert queue.has_dropped


#: ``fprintf`` holds the GIL, as rclpy does when rcl logs.
PROGRAM = """
import ctypes, os, subprocess, sys
from composer.cli.support.console import queued_output
libc = ctypes.PyDLL(None)
stderr = ctypes.c_void_p.in_dll(libc, "stderr")
with queued_output():
    print("from Python")
    print("a message", file=sys.stderr)
    if os.fork() == 0:
        sys.stdout.write("from a forked process\\n")
        sys.stdout.flush()
        os._exit(0)
    os.wait()
    for _ in range(LINES):
        libc.fprintf(stderr, b"from C code%s" % (b" " * 1000))
    if STARTS:
        subprocess.run([sys.executable, "-c", "import os, sys; os.write(2, b'#' * 300_000)"])
    assert os.get_blocking(1) and os.get_blocking(2)
print("the end")
"""


def run(stderr: int, *, lines: int = 1, starts: bool = False) -> subprocess.Popen[str]:
    program = f"LINES, STARTS = {lines}, {starts}\n{PROGRAM}"
    return subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=stderr, text=True
    )


def ended(process: subprocess.Popen[str]) -> tuple[list[str], str]:
    out, error = process.communicate(timeout=LIMIT_S)
    assert process.returncode == 0, error
    return sorted(out.splitlines()), error


PRINTED = ["from Python", "from a forked process", "the end"]


def test_prints_of_every_origin_arrive() -> None:
    lines, error = ended(run(subprocess.PIPE))
    assert lines == PRINTED
    assert "a message\n" in error
    assert "from C code" in error


def test_c_code_does_not_wait_for_a_pipe_that_nothing_reads() -> None:
    pipe = FullPipe()
    lines, _ = ended(run(pipe.writing, lines=100))
    assert lines == PRINTED
    pipe.close_writing()
    assert b"from C code" not in pipe.read(), "an error instead of a wait"


def test_c_code_does_not_wait_for_a_socket_that_nothing_reads() -> None:
    ours, theirs = socket.socketpair()
    lines, _ = ended(run(theirs.fileno(), lines=5000))
    assert lines == PRINTED
    theirs.close()
    ours.settimeout(LIMIT_S)
    assert b"from C code" in b"".join(iter(lambda: ours.recv(65_536), b""))
    ours.close()


def waiting_bytes(fd: int) -> int:
    return int.from_bytes(fcntl.ioctl(fd, termios.FIONREAD, bytes(4)), sys.byteorder)


def test_a_started_process_waits_until_it_can_print() -> None:
    reading, writing = os.pipe()
    process = run(writing, starts=True)
    os.close(writing)
    with os.fdopen(reading, "rb") as pipe:
        until_s = time.monotonic() + LIMIT_S
        while waiting_bytes(reading) < 60_000 and time.monotonic() < until_s:
            time.sleep(0.01)  # poll until the pipe is full: it holds 64 KiB
        received = pipe.read()
    assert received.count(b"#") == 300_000
    assert ended(process)[0] == PRINTED


NOISY = """
import os
from composer.cli.support.terminal import keep_stdout_for_data, say, write
keep_stdout_for_data()
keep_stdout_for_data()
write("data")
os.write(1, b"noise of a library\\n")
say("talk")
write("more data")
"""


def test_output_of_libraries_goes_to_stderr() -> None:
    done = run_python("-c", NOISY)
    assert done.stdout == "data\nmore data\n"
    assert done.stderr == "noise of a library\ntalk\n"


@pytest.mark.parametrize("target", ["full disk", "closed pipe"])
def test_messages_that_cannot_be_written_do_not_change_the_exit_code(target: str) -> None:
    if target == "full disk":
        writing = os.open("/dev/full", os.O_WRONLY)
    else:
        reading, writing = os.pipe()
        os.close(reading)
    done = run_python("-m", "composer", "validate", "no_such_file.yaml", stderr=writing)
    os.close(writing)
    assert done.returncode == 2
