"""The launcher: a small process that starts child processes and never leaves any behind.

It is a program of its own, ``python -I -S launcher.py SOCKET FOLDER``, and imports nothing of the
composer. The composer starts it once and sends requests over a socket. Why not start children from
the composer itself:

- However the composer ends, ``kill -9`` included, the socket closes, and the launcher ends every
  child in order: SIGINT, SIGTERM, SIGKILL, each to the whole process group.
- If the launcher itself is killed, Linux kills the children (PR_SET_PDEATHSIG). This is bound to
  the thread that starts a child; the launcher has only one. The composer kills their descendants:
  MARK in their environment names the folder of the launcher.
- Forking a process with many threads is not safe if anything happens between fork and exec.
- Grandchildren that outlive their parent become children of the launcher (a child subreaper).

Requests and reports are JSON, one per packet. ``id`` identifies a child.

    {"start": id, "command": [...], "environment": {...}, "folder": path or null}    + 2 descriptors
    {"end": id, "terminate_s": seconds after SIGINT, "kill_s": seconds after SIGTERM}
    {"started": id, "pid": number}   {"failed": id, "reason": text}
    {"ended": id, "status": exit status, or minus the number of the signal}
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import select
import shutil
import signal
import socket
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any

MAX_PACKET = 200_000
#: The environment variable by which the descendants of a killed launcher are found.
MARK = "COMPOSE_LAUNCHER"
_PR_SET_PDEATHSIG = 1
_PR_SET_CHILD_SUBREAPER = 36
_LIBC = ctypes.CDLL(None)
#: The limits for children of a composer that was killed.
_ORPHAN_TERMINATE_S = 0.5
_ORPHAN_KILL_S = 0.5


class _Child:
    """A child process, the leader of its group, and the signals that are still to come."""

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        self.process = process
        self.is_interrupted = False
        self.signals: list[
            tuple[float, int]
        ] = []  # (due by time.monotonic(), number), the next one first

    def end(self, terminate_s: float, kill_s: float) -> None:
        """Interrupt the group now, and send stronger signals later."""
        now_s = time.monotonic()
        if not self.is_interrupted:
            self.is_interrupted = True
            self.send(signal.SIGINT)
        due_s = now_s + terminate_s
        self.signals = [(due_s, signal.SIGTERM), (due_s + kill_s, signal.SIGKILL)]

    def send(self, number: int) -> None:
        """Send a signal to the group. Its leader is not reaped yet, so its number is valid."""
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self.process.pid, number)

    def send_due(self, now_s: float) -> None:
        """Send the signals that are due."""
        while self.signals and self.signals[0][0] <= now_s:
            self.send(self.signals.pop(0)[1])


class Launcher:
    """Serves the requests of one composer until its socket closes and all children have ended."""

    def __init__(self, connection: socket.socket, folder: str) -> None:
        self._connection = connection
        self._folder = folder
        self._children: dict[int, _Child] = {}
        self._is_orphan = False
        self._wakeup, wakeup = socket.socketpair()
        for end in (self._wakeup, wakeup):
            end.setblocking(False)
        self._wakeup_writer = wakeup
        signal.set_wakeup_fd(wakeup.fileno(), warn_on_full_buffer=False)
        # Handlers, not SIG_IGN: exec resets handlers, so that children start with the defaults.
        stop = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
        for number in (signal.SIGCHLD, *stop):
            signal.signal(number, _ignore)

    def run(self) -> None:
        """Serve requests. Return once the composer has gone and no child is left."""
        while not (self._is_orphan and not self._children):
            waiting = [self._wakeup] if self._is_orphan else [self._wakeup, self._connection]
            ready, _, _ = select.select(waiting, [], [], self._left_s())
            if self._wakeup in ready:
                with contextlib.suppress(BlockingIOError):
                    self._wakeup.recv(4096)
            self._reap()
            if self._connection in ready:
                self._serve()
            now_s = time.monotonic()
            for child in self._children.values():
                child.send_due(now_s)
        _kill_descendants()

    def _left_s(self) -> float | None:
        due_s = [child.signals[0][0] for child in self._children.values() if child.signals]
        return max(0.0, min(due_s) - time.monotonic()) if due_s else None

    def _serve(self) -> None:
        try:
            packet, descriptors, _, _ = socket.recv_fds(self._connection, MAX_PACKET, 2)
        except ConnectionError:
            packet, descriptors = b"", []
        try:
            if not packet:
                self._on_orphaned()
                return
            request = json.loads(packet)
            if "start" in request:
                if not self._is_composer_gone():
                    self._start(request, descriptors)
            elif request["end"] in self._children:
                child = self._children[request["end"]]
                child.end(request["terminate_s"], request["kill_s"])
        finally:
            for descriptor in descriptors:
                os.close(descriptor)

    def _is_composer_gone(self) -> bool:
        """Return whether the socket is closed, also while there are requests left to read."""
        poller = select.poll()
        poller.register(self._connection, select.POLLHUP)
        return any(event & select.POLLHUP for _, event in poller.poll(0))

    def _on_orphaned(self) -> None:
        self._is_orphan = True
        for child in self._children.values():
            if not child.signals:
                child.end(_ORPHAN_TERMINATE_S, _ORPHAN_KILL_S)

    def _start(self, request: dict[str, Any], descriptors: list[int]) -> None:
        output, errors = descriptors
        try:
            process = subprocess.Popen(  # noqa: S603  (what the user declares; one thread)
                request["command"],
                env={**os.environ, **request["environment"], MARK: self._folder},
                cwd=request["folder"],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=errors,
                process_group=0,
                preexec_fn=partial(_die_with, os.getpid()),  # noqa: PLW1509  (one thread)
            )
        except (OSError, ValueError, subprocess.SubprocessError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            self._report({"failed": request["start"], "reason": reason})
            return
        self._children[request["start"]] = _Child(process)
        self._report({"started": request["start"], "pid": process.pid})

    def _reap(self) -> None:
        """Report children that have ended, and kill what is left of their groups."""
        by_pid = {child.process.pid: name for name, child in self._children.items()}
        while True:
            try:
                info = os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
            except ChildProcessError:
                return
            if info is None:
                return
            name = by_pid.get(info.si_pid)
            if name is not None:
                self._children[name].send(signal.SIGKILL)  # before its number can be reused
            _, status = os.waitpid(info.si_pid, 0)
            if name is not None:
                status = os.waitstatus_to_exitcode(status)
                child = self._children.pop(name)
                child.process.returncode = status
                self._report({"ended": name, "status": status})

    def _report(self, report: dict[str, object]) -> None:
        with contextlib.suppress(OSError):
            self._connection.send(json.dumps(report).encode())


def _ignore(_: int, __: FrameType | None) -> None:
    pass


def _die_with(parent: int) -> None:
    """Let Linux kill the child when the launcher ends, which may have happened already."""
    _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os.kill(os.getpid(), signal.SIGKILL)


def _kill_descendants() -> None:
    """Kill the grandchildren that have left the groups of their parents."""
    for _ in range(100):  # each one's children become ours in turn
        try:
            text = Path(f"/proc/self/task/{os.getpid()}/children").read_text(encoding="ascii")
        except OSError:
            return
        found = [int(number) for number in text.split()]
        if not found:
            return
        for number in found:
            with contextlib.suppress(ProcessLookupError):
                os.kill(number, signal.SIGKILL)
        for number in found:
            with contextlib.suppress(ChildProcessError):
                os.waitpid(number, 0)


def main() -> None:
    """Serve the socket that the composer has passed on."""
    _LIBC.prctl(_PR_SET_CHILD_SUBREAPER, 1)
    connection = socket.socket(fileno=int(sys.argv[1]))
    connection.set_inheritable(False)
    try:
        Launcher(connection, sys.argv[2]).run()
    finally:
        shutil.rmtree(sys.argv[2], ignore_errors=True)


if __name__ == "__main__":
    main()
