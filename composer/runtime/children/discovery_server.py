"""The discovery servers that a system starts: Fast DDS' own program, restarted if it ends.

A server that was killed must not be replaced at once. Its successor has the same identity, and as
long as clients do not notice the loss, they do not announce themselves again: new participants
would never discover them. So the successor starts after the lease of the lost server, which its
profile shortens. Participants that have discovered each other communicate without a server.

The same is true after the process that started the server was killed: the next one finds the
record of the lost server, a file next to the instance locks, and waits as long.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TextIO

from composer.model import Discovery, LogLevel
from composer.model.names import PROGRAM_LOGGER
from composer.runtime.children.child_processes import Child, ChildProcesses, Command
from composer.runtime.clock import COMPUTER
from composer.runtime.middleware.environment import active_variables
from composer.runtime.process import StartRefused
from composer.runtime.process.computer import PortState, is_own_address, port_state, resolve
from composer.runtime.process.instance_lock import open_private

_BOOT = Path("/proc/sys/kernel/random/boot_id")
_PROGRAM = "fast-discovery-server"
_PROFILE = Path(__file__).with_name("discovery_server.xml")
#: The lease in the profile, and the time until clients have noticed its end.
RESTART_DELAY_S = 6.0
#: A server that was idle for so long has passed on that the nodes have left. If it ends earlier,
#: clients may not discover the nodes of the next start: see docs/decisions/0011-fast-dds.md.
_IDLE_S = 0.2
_IDLE_WITHIN_S = 1.0
_POLL_S = 0.02
_ENDS_WITHIN_S = 1.0
_KILLED_WITHIN_S = 0.5
#: Receives the level, the logger and the text of a line.
Write = Callable[[LogLevel, str, str], None]


class ServerRecord:
    """The record of one server, locked by the process that runs it.

    Without a folder that only this user can write to, nothing is recorded.
    """

    def __init__(self, number: int, address: str, port: int) -> None:
        """Open the record of the server with this position in the list, and lock it."""
        #: Whether another process of this computer runs the server, or is about to.
        self.is_held_elsewhere = False
        self._file = _open(f"discovery-server.{number}.{address}.{port}")
        if self._file is None:
            return
        try:
            # Not inherited by processes that user code forks, as a lock of flock() would be.
            fcntl.lockf(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self.is_held_elsewhere = True
            self.close()

    @property
    def is_lost(self) -> bool:
        """Whether the server did not end in order, since this computer was started."""
        if self._file is None:
            return False
        self._file.seek(0)
        return self._file.read() == _this_boot()

    def set_running(self) -> None:
        """Record that the server runs, before it is started."""
        self._write(_this_boot())

    def set_ended(self) -> None:
        """Record that no client can take the next server for this one."""
        self._write("")

    def close(self) -> None:
        """Release the lock."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def _write(self, text: str) -> None:
        if self._file is not None:
            self._file.seek(0)
            self._file.truncate()
            self._file.write(text)
            self._file.flush()


def _open(name: str) -> TextIO | None:
    try:
        return open_private(name)
    except (OSError, StartRefused):
        return None


def _this_boot() -> str:
    return _BOOT.read_text(encoding="ascii")


def _sleep_until(until_s: float) -> bool:
    COMPUTER.sleep(max(0.0, until_s - COMPUTER.monotonic()))
    return False


@contextmanager
def discovery_servers(
    discovery: Discovery | None,
    environment: Mapping[str, str],
    write_log: Write,
    wait_until: Callable[[float], bool] = _sleep_until,
    *,
    shared: bool = True,
) -> Iterator[None]:
    """Run the servers of a system that have an address of this computer, during the block.

    Without effect unless the system starts servers and the environment allows its discovery. A port
    in use is taken as a server that runs already, and refused if it is not ``shared``. After the
    lost server of a killed process, ``wait_until(time)`` (monotonic) is called first; no server
    starts if it returns True, which means that the system has to stop. Raises StartRefused.
    """
    if discovery is None or not discovery.start or not active_variables(discovery, environment):
        yield
        return
    children = ChildProcesses()
    ours = [
        _Server(number, server, address, children, write_log)
        for number, server in enumerate(discovery.servers)
        if (address := _own_address(server[0])) is not None
    ]
    if not ours:
        listed = ", ".join(host for host, _ in discovery.servers)
        raise StartRefused(
            f"the discovery server cannot be started here: this computer is not {listed}",
            "set its 'address' to one that 'ip address' lists, or set 'start: false'",
        )
    try:
        if _outlast_lost(ours, wait_until):
            for server in ours:
                server.start(shared=shared)
        yield
    finally:
        _end(ours, children)


def _own_address(host: str) -> str | None:
    """Return the IPv4 address of a server; None if it is one of another computer."""
    address = resolve(host)
    if address is None:
        raise StartRefused(
            f"the name of the discovery server, '{host}', cannot be resolved",
            "correct the name, or use an IPv4 address",
        )
    return address if is_own_address(address) else None


def _outlast_lost(servers: list[_Server], wait_until: Callable[[float], bool]) -> bool:
    """Wait until clients have noticed the end of lost servers; return False if asked to stop."""
    lost = [server for server in servers if server.is_lost]
    for server in lost:
        server.announce_delay()
    return not lost or not wait_until(COMPUTER.monotonic() + RESTART_DELAY_S)


def _end(servers: list[_Server], children: ChildProcesses) -> None:
    """End all servers at the same time, and the launcher of their processes."""
    _wait_until_idle([pid for server in servers if (pid := server.pid) is not None])
    for server in servers:
        server.end()
    children.close(COMPUTER.monotonic() + _ENDS_WITHIN_S + _KILLED_WITHIN_S)
    for server in servers:
        server.close()


def _wait_until_idle(pids: Sequence[int]) -> None:
    """Wait until processes have had nothing to do for a moment, on a busy computer a longer one."""
    end_s = COMPUTER.monotonic() + _IDLE_WITHIN_S
    idle_s = COMPUTER.monotonic() + _IDLE_S
    while pids and COMPUTER.monotonic() < min(idle_s, end_s):
        COMPUTER.sleep(_POLL_S)  # no event says that a process is idle
        if any(map(has_work, pids)):
            idle_s = COMPUTER.monotonic() + _IDLE_S


def has_work(pid: int) -> bool:
    """Return whether a thread of a process runs, or waits for a processor."""
    states = []
    for thread in Path(f"/proc/{pid}/task").glob("*/stat"):
        with suppress(OSError):  # it has ended
            states.append(thread.read_text(encoding="utf-8").rpartition(") ")[2][:1])
    return "R" in states


class _Server:
    """One server: the process that runs, or the time at which the next one starts."""

    def __init__(
        self,
        number: int,
        server: tuple[str, int],
        address: str,
        children: ChildProcesses,
        write_log: Write,
    ) -> None:
        host, port = server
        self._words = (
            *("-i", str(number), "-l", host, "-p", str(port)),
            *("-x", f"server@{_PROFILE}"),
        )
        self._name = f"discovery server {host}:{port}"
        self._address, self._port = address, port
        self._write_log = write_log
        self._record = ServerRecord(number, address, port)
        self._children = children
        self._lock = threading.Lock()
        self._child: Child | None = None
        self._timer: threading.Timer | None = None
        self._is_ending = False

    @property
    def is_lost(self) -> bool:
        """Whether the last server was lost with the process that had started it."""
        return self._record.is_lost

    @property
    def pid(self) -> int | None:
        """The process id of a server that was started here."""
        return None if self._child is None else self._child.pid

    def announce_delay(self) -> None:
        """Say why the server is not started at once."""
        self._log(
            LogLevel.WARN,
            f"{self} starts in {RESTART_DELAY_S:g} s: the last one was lost, as its 'compose run'"
            " was killed, and other programs may not have noticed its end yet",
        )

    def start(self, *, shared: bool = True) -> bool:
        """Start the server, unless one runs already; return whether it did.

        Raises StartRefused, also if one runs already and it is not to be ``shared``.
        """
        state = port_state(self._address, self._port)
        if self._record.is_held_elsewhere or state is PortState.IN_USE:
            if not shared:
                raise StartRefused(f"{self} runs already", "end the program that uses its port")
            self._record.set_ended()
            self._record.close()
            self._log(LogLevel.INFO, f"{self} runs already, and is used")
            return False
        command = Command((_program(), *self._words))
        try:
            with self._lock:
                if self._is_ending:
                    return False
                self._record.set_running()
                self._child = child = self._children.start(command, self._on_line)
        except OSError as error:
            raise StartRefused(
                f"{self} cannot be started: {error}", "see 'compose doctor'"
            ) from error
        child.ended.add_done_callback(lambda _: self._on_end(child))
        return True

    def end(self) -> None:
        """Ask the server to end: in order, so that clients do not wait for the end of its lease."""
        with self._lock:
            self._is_ending = True
            child, timer = self._child, self._timer
        if timer is not None:
            timer.cancel()
        if child is not None:
            self._children.end(child, _ENDS_WITHIN_S, _KILLED_WITHIN_S)

    def close(self) -> None:
        """Record how the server has ended, and let others start it."""
        ended = None if self._child is None else self._child.ended
        if ended is not None and ended.done() and not ended.cancelled() and ended.result() == 0:
            self._record.set_ended()
        self._record.close()

    def __str__(self) -> str:
        return self._name

    def _on_line(self, text: str, is_error: bool) -> None:
        if is_error:
            self._log(LogLevel.WARN, text)

    def _on_end(self, child: Child) -> None:
        with self._lock:
            if self._is_ending:
                return
            self._child = None
            self._timer = threading.Timer(RESTART_DELAY_S, self._restart)
            self._timer.daemon = True
            self._timer.start()
        ended = f"{self} {child.how_ended or 'has ended'}"
        self._log(
            LogLevel.WARN,
            f"{ended}; the next one starts in {RESTART_DELAY_S:g} s. Nodes that know each other"
            " still communicate",
        )

    def _restart(self) -> None:
        try:
            if self.start():
                self._log(LogLevel.INFO, f"{self} is started again")
        except StartRefused as refusal:
            self._log(LogLevel.ERROR, f"{refusal}: {refusal.hint}")

    def _log(self, level: LogLevel, text: str) -> None:
        self._write_log(level, PROGRAM_LOGGER, text)


def _program() -> str:
    """Return the path of the server program, which is part of Fast DDS. Raises StartRefused."""
    prefixes = (
        sys.prefix,
        *filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)),
    )
    folders = [str(Path(prefix, "bin")) for prefix in prefixes]
    path = os.pathsep.join([*folders, os.environ.get("PATH", os.defpath)])
    found = shutil.which(_PROGRAM, path=path)
    if found is None:
        raise StartRefused(
            f"the discovery server cannot be started: there is no program '{_PROGRAM}'",
            "it is part of Fast DDS: use the middleware rmw_fastrtps, or set 'start: false' and run"
            " a server elsewhere",
        )
    return found
