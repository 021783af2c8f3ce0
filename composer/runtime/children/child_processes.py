"""The child processes of a system: started and ended by the launcher, watched on one thread."""

from __future__ import annotations

import json
import os
import selectors
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import field
from functools import partial
from pathlib import Path
from typing import Any

from composer.base.fast_dataclass import dataclass
from composer.runtime.children import launcher
from composer.runtime.children.output import OutputLines
from composer.runtime.clock import COMPUTER
from composer.runtime.executors.futures import Future

_READ_BYTES = 65_536
#: How long the launcher may take to kill what is left, on a busy machine.
_LAUNCHER_ENDS_WITHIN_S = 2.0
_POLL_S = 0.005
_ROUNDS = 100


class StartFailed(Exception):
    """A program cannot be started; the text is the reason."""


def signal_name(number: int) -> str:
    """Return the name of the signal that ended a process, such as SIGKILL."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


@dataclass(frozen=True, slots=True)
class Command:
    """A program to start: the words of its command line, changes to the environment, a folder."""

    words: Sequence[str]
    environment: Mapping[str, str] = field(default_factory=dict)
    folder: Path | None = None


@dataclass(slots=True)
class Child:
    """A process that was started. ``ended`` has the result of its exit.

    That is its exit status, or minus the number of the signal that ended it.
    """

    number: int  # by which the launcher knows it
    started: Future[int] = field(default_factory=Future)  # its process id
    ended: Future[int] = field(default_factory=Future)
    outputs: dict[int, OutputLines] = field(default_factory=dict)  # by descriptor
    is_ending: bool = False

    @property
    def pid(self) -> int | None:
        """The process id once it has started."""
        has_started = self.started.done() and self.started.exception() is None
        return self.started.result() if has_started else None

    @property
    def how_ended(self) -> str:
        """How it has ended, in words; empty while it runs, and if it never started."""
        if not self.ended.done() or self.ended.cancelled():
            return ""
        status = self.ended.result()
        if status >= 0:
            return f"exited with status {status}"
        return f"was ended by {signal_name(-status)}"


class ChildProcesses:
    """Starts children and reports their output and their end, on a thread of its own.

    The launcher and the thread are started together with the first child.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._children: dict[int, Child] = {}
        self._number = 0
        self._launcher: subprocess.Popen[bytes] | None = None
        self._connection: socket.socket | None = None
        self._selector = selectors.DefaultSelector()
        self._thread: threading.Thread | None = None
        #: The launcher removes it, even if this process is killed.
        self._folder: Path | None = None

    def prepare(self) -> Path:
        """Start the launcher unless it runs; return the folder for temporary files.

        Raises OSError.
        """
        with self._lock:
            if self._launcher is None or self._folder is None:
                self._folder = self._start_launcher()
            return self._folder

    def start(self, command: Command, on_line: Callable[[str, bool], None]) -> Child:
        """Start a program; ``on_line(text, is_error)`` is called for each line of its output.

        The future ``started`` fails with StartFailed, ``ended`` is done once its output is read.
        Raises OSError.
        """
        self.prepare()
        output, output_writer = os.pipe2(os.O_CLOEXEC | os.O_NONBLOCK)
        errors, errors_writer = os.pipe2(os.O_CLOEXEC | os.O_NONBLOCK)
        for writer in (output_writer, errors_writer):
            os.set_blocking(writer, True)
        with self._lock:
            self._number += 1
            child = Child(self._number)
            self._children[child.number] = child
        for descriptor, is_error in ((output, False), (errors, True)):
            child.outputs[descriptor] = OutputLines(partial(_call, on_line, is_error))
            self._selector.register(descriptor, selectors.EVENT_READ, child)
        request = {
            "start": child.number,
            "command": list(command.words),
            "environment": dict(command.environment),
            "folder": None if command.folder is None else str(command.folder),
        }
        try:
            self._send(request, [output_writer, errors_writer])
        except OSError as error:
            self._finish(child, None, str(error))
        finally:
            os.close(output_writer)
            os.close(errors_writer)
        return child

    def end(self, child: Child, terminate_s: float, kill_s: float) -> None:
        """Interrupt a child; terminate it after ``terminate_s``, kill it after ``kill_s`` more."""
        if not child.ended.done():
            child.is_ending = True
            with suppress(OSError):  # the launcher is gone, and with it its children
                self._send({"end": child.number, "terminate_s": terminate_s, "kill_s": kill_s})

    def close(self, end_s: float = 0.0) -> None:
        """End the launcher, and before it all children that have not ended by ``end_s``.

        Until then (monotonic), it waits for those that are ending already.
        """
        while COMPUTER.monotonic() < end_s and any(
            child.is_ending for child in tuple(self._children.values())
        ):
            COMPUTER.sleep(_POLL_S)
        with self._lock:
            connection, self._connection = self._connection, None
            running = self._launcher
        if connection is None or running is None:
            return
        with suppress(OSError):  # it was killed, and its children with it
            for child in tuple(self._children.values()):
                packet = {"end": child.number, "terminate_s": 0.0, "kill_s": 0.0}
                connection.send(json.dumps(packet).encode())
            connection.shutdown(socket.SHUT_WR)
        if self._thread is not None:
            self._thread.join(_LAUNCHER_ENDS_WITHIN_S)
        connection.close()
        try:
            running.wait(_LAUNCHER_ENDS_WITHIN_S)
        except subprocess.TimeoutExpired:
            running.kill()  # the thread removes what is left

    def _start_launcher(self) -> Path:
        folder = Path(tempfile.mkdtemp(prefix="compose-"))
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self._launcher = subprocess.Popen(  # noqa: S603  (a program of this package)
                [
                    sys.executable,
                    *("-I", "-S"),
                    launcher.__file__,
                    str(theirs.fileno()),
                    str(folder),
                ],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                # It outlives a killed parent of its own: it has something to end.
                env={name: text for name, text in os.environ.items() if name != launcher.MARK},
                pass_fds=[theirs.fileno()],
                start_new_session=True,  # Ctrl-C is for the composer
            )
        self._connection = ours
        self._selector.register(ours, selectors.EVENT_READ, None)
        self._thread = threading.Thread(
            target=self._run, args=(ours, folder), name="child processes", daemon=True
        )
        self._thread.start()
        return folder

    def _send(self, request: dict[str, Any], descriptors: Sequence[int] = ()) -> None:
        packet = json.dumps(request).encode()
        if len(packet) > launcher.MAX_PACKET:
            raise OSError("its command line and environment are too long")
        with self._lock:
            if self._connection is None:
                raise OSError("the launcher of child processes has ended")
            socket.send_fds(self._connection, [packet], list(descriptors))

    # --- on the thread

    def _run(self, connection: socket.socket, folder: Path) -> None:
        is_open = True
        while is_open:
            for key, _ in self._selector.select():
                if key.data is None:
                    is_open = self._receive(connection)
                else:
                    self._read(key.data, key.fd)
        self._on_launcher_ended(connection, folder)

    def _receive(self, connection: socket.socket) -> bool:
        """Handle a report of the launcher; return false once it has ended."""
        try:
            packet = connection.recv(launcher.MAX_PACKET)
        except OSError:
            return False
        if not packet:
            return False
        report = json.loads(packet)
        if "started" in report:
            self._children[report["started"]].started.set_result(report["pid"])
        elif "failed" in report:
            self._finish(self._children[report["failed"]], None, report["reason"])
        else:
            self._finish(self._children[report["ended"]], report["status"])
        return True

    def _read(self, child: Child, descriptor: int) -> bool:
        """Read what is there now; return false if there is nothing."""
        if descriptor not in child.outputs:
            return False  # closed since the selector reported it
        try:
            data = os.read(descriptor, _READ_BYTES)
        except BlockingIOError:
            return False
        if not data:
            self._close_output(child, descriptor)
            return False
        child.outputs[descriptor].add(data, COMPUTER.monotonic())
        return True

    def _close_output(self, child: Child, descriptor: int) -> None:
        output = child.outputs.pop(descriptor, None)
        if output is not None:
            output.finish()
            self._selector.unregister(descriptor)
            os.close(descriptor)

    def _finish(self, child: Child, status: int | None, reason: str = "") -> None:
        """Read the rest of the output of a child and report its end."""
        self._children.pop(child.number, None)
        for descriptor in tuple(child.outputs):
            while self._read(child, descriptor):
                pass
            self._close_output(child, descriptor)
        if status is None:
            child.started.set_exception(StartFailed(reason))
            child.ended.cancel()
        else:
            child.ended.set_result(status)

    def _on_launcher_ended(self, connection: socket.socket, folder: Path) -> None:
        """Forget a launcher that has ended. If it was killed, Linux has killed its children."""
        self._selector.unregister(connection)
        if folder.exists():  # else it has removed it, after everything else
            kill_descendants(folder)
            shutil.rmtree(folder, ignore_errors=True)
        with self._lock:
            if self._connection is connection and self._launcher is not None:
                connection.close()
                self._launcher.wait()
                self._connection = self._launcher = self._folder = None
        for child in tuple(self._children.values()):
            pid = child.pid
            if pid is None:
                self._finish(child, None, "the launcher of child processes has ended")
            else:
                self._finish(child, -9)


def kill_descendants(folder: Path) -> None:
    """Kill the processes that a killed launcher, or what it has started, has left behind.

    ``folder`` is the folder of the launcher, which they have in their environments.
    """
    mark = f"{launcher.MARK}={folder}".encode()
    for _ in range(_ROUNDS):  # they may start others in the meantime
        processes = [entry for entry in Path("/proc").iterdir() if entry.name.isdigit()]
        killed = [_kill_if_marked(entry, mark) for entry in processes]
        if not any(killed):
            return


def _kill_if_marked(entry: Path, mark: bytes) -> bool:
    """Kill the process of an entry of /proc with ``mark`` in its environment.

    Return whether it had it, or may have it: while a program starts, its environment is empty.
    """
    try:
        process = os.pidfd_open(int(entry.name))  # its number may be reused once it has ended
    except OSError:
        return False
    try:
        environment = (entry / "environ").read_bytes()
        if not environment:
            (entry / "exe").readlink()  # threads of the kernel have no program
            return True
        if mark not in environment.split(b"\0"):
            return False
        signal.pidfd_send_signal(process, signal.SIGKILL)
    except OSError:  # it has ended, or belongs to another user
        return False
    finally:
        os.close(process)
    return True


def _call(on_line: Callable[[str, bool], None], is_error: bool, text: str) -> None:
    on_line(text, is_error)
