"""A running system over several computers: its coordinating process here, the others by ssh.

Each process runs under a guard (:mod:`composer.client.hosts.guard`), to which this program says
every few seconds that it is still there. So everything ends with this program, however it ends,
while a short failure of the network ends nothing.
"""

from __future__ import annotations

import asyncio
import math
import os
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import asyncssh

from composer.base.fast_dataclass import dataclass
from composer.client.hosts.connection import SILENCE_S, HostError, connect, failure_of, shown
from composer.client.hosts.remote_command import (
    GUARD,
    NO_PYTHON,
    NO_SETUP,
    NO_WORKSPACE,
    python_command,
)
from composer.model import Host, LogLevel, Process
from composer.model.names import PROGRAM_LOGGER
from composer.runtime.children.output import OutputLines, attribute_line, process_loggers
from composer.runtime.process.watchdog import SAME_REQUEST_S

_BEAT_S = 2.0
_RETRY_S = 1.0
_LONGEST_RETRY_S = 10.0
#: A process that has run for so long is started again at once.
_SETTLED_S = 30.0
_ENDS_WITHIN_S = 20.0
#: After the second request to end everything.
_ENDS_AT_ONCE_S = 1.0
#: Exit codes after which a process is not started again: it cannot work.
_USAGE, _CONFIG = 2, 78
_FINAL = (_USAGE, _CONFIG, NO_WORKSPACE, NO_SETUP, NO_PYTHON)
#: What the composer logs in a process begins with that.
_OF_COMPOSER = f"[{PROGRAM_LOGGER}] "
_SESSIONS = "a host needs one for each process: increase MaxSessions in its sshd_config"


@dataclass(frozen=True, slots=True)
class RemoteProcess:
    """A process of the system, its host, and the full names of its nodes."""

    process: Process
    host: Host
    nodes: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """Return what its lines begin with."""
        return f"{self.process.name}@{self.host.name}"


@dataclass(frozen=True, slots=True)
class DeploymentOptions:
    """What is started: ``system`` is relative to ``root``, the root of the project.

    ``start`` are options of ``compose run`` for all processes. ``compose`` is the command line of
    this program; ``write`` prints a line, ``log`` keeps one of a process in its log: its level,
    logger and message.
    """

    root: Path
    system: str
    start: Sequence[str]
    compose: Sequence[str]
    write: Callable[[str], None]
    log: Callable[[RemoteProcess, LogLevel, str, str], None]


class Deployment:
    """The processes of one system."""

    def __init__(self, processes: Sequence[RemoteProcess], options: DeploymentOptions) -> None:
        self._processes = processes
        self._options = options
        self._is_ending = asyncio.Event()
        self._is_urgent = asyncio.Event()
        self._requested_s = math.inf
        self._is_down = asyncio.Event()  # the coordinating process has ended
        self._problem: HostError | None = None

    def end(self) -> None:
        """End everything in order; after the second request, at once."""
        now_s = time.monotonic()
        if now_s - self._requested_s > SAME_REQUEST_S:
            self._is_urgent.set()
        self._requested_s = min(now_s, self._requested_s)
        self._is_ending.set()

    async def run(self, connections: Mapping[str, asyncssh.SSHClientConnection]) -> int:
        """Run the system until it ends, or :meth:`end` is called; return its exit code.

        Raises HostError if a process cannot be started.
        """
        hosts = {item.host.name.value: item.host for item in self._processes}
        serving = [
            asyncio.create_task(self._serve(host, connections[name]))
            for name, host in hosts.items()
        ]
        try:
            code = await self._coordinate()
        finally:
            self._is_ending.set()
            self._is_down.set()
            await self._until_urgent(asyncio.create_task(asyncio.wait(serving)), _ENDS_WITHIN_S)
            for task in serving:
                task.cancel()
            results = await asyncio.gather(*serving, return_exceptions=True)
        if self._problem is not None:
            raise self._problem
        for result in results:
            if isinstance(result, Exception):  # a defect: it has ended everything
                raise result
        return code

    async def _coordinate(self) -> int:
        """Run the coordinating process on this computer."""
        words = (sys.executable, "-P", "-m", GUARD, f"{SILENCE_S:g}", *self._options.compose)
        process = await asyncio.create_subprocess_exec(
            *words,
            "run",
            str(self._options.root / self._options.system),
            *self._options.start,
            stdin=asyncio.subprocess.PIPE,
            start_new_session=True,  # Ctrl-C is handled here
        )
        stdin = process.stdin
        if stdin is None:
            raise AssertionError("no standard input")
        ended = asyncio.create_task(process.wait())
        ending = asyncio.create_task(self._is_ending.wait())
        while not ended.done() and not ending.done():
            with suppress(ConnectionError):
                stdin.write(b".")
            await asyncio.wait(
                (ended, ending), timeout=_BEAT_S, return_when=asyncio.FIRST_COMPLETED
            )
        stdin.close()  # the guard ends it
        ending.cancel()
        await self._until_urgent(ended)
        if not ended.done():
            process.terminate()  # the guard passes it on
            await asyncio.wait((ended,), timeout=_ENDS_AT_ONCE_S)
        if not ended.done():
            process.kill()
        return await ended

    async def _until_urgent(
        self, work: asyncio.Future[Any], timeout_s: float | None = None
    ) -> None:
        """Wait for ``work``, for a time, and until the second request to end everything."""
        urgent = asyncio.create_task(self._is_urgent.wait())
        await asyncio.wait((work, urgent), timeout=timeout_s, return_when=asyncio.FIRST_COMPLETED)
        urgent.cancel()

    async def _serve(self, host: Host, connection: asyncssh.SSHClientConnection) -> None:
        """Run the processes of one host; connect again whenever the connection is lost."""
        own = [item for item in self._processes if item.host is host]
        current: asyncssh.SSHClientConnection | None = connection
        while current is not None:
            tasks = [asyncio.create_task(self._keep(item, current)) for item in own]
            try:
                await asyncio.gather(*tasks)
            except (asyncssh.Error, OSError) as error:
                for task in tasks:
                    task.cancel()
                await asyncio.gather(*tasks, return_exceptions=True)
                current.abort()
                if self._is_ending.is_set():
                    self._options.write(
                        f"{host.name}: not reachable; its processes end within {SILENCE_S:g} s"
                    )
                    return
                reason = getattr(error, "reason", "") or str(error) or "it was closed"
                self._options.write(
                    f"{host.name}: connection lost ({shown(reason)}); connecting again"
                )
            except HostError as error:
                self._problem = self._problem or error
                self._is_ending.set()
                await asyncio.gather(*tasks, return_exceptions=True)
                return
            except Exception:
                self._is_ending.set()
                raise
            else:
                return
            current = await self._reconnect(host)

    async def _reconnect(self, host: Host) -> asyncssh.SSHClientConnection | None:
        """Return a new connection; None if everything ends before."""
        while not self._is_ending.is_set():
            try:
                connection = await connect(host, self._options.root)
            except HostError:
                await self._pause(_RETRY_S)
                continue
            self._options.write(f"{host.name}: connected again")
            return connection
        return None

    async def _keep(self, item: RemoteProcess, connection: asyncssh.SSHClientConnection) -> None:
        """Run a process, and start it again if it ends. Raises HostError, asyncssh.Error."""
        retry_s = _RETRY_S
        while not self._is_ending.is_set():
            started_s = time.monotonic()
            status, tail = await self._run_once(item, connection)
            if self._is_ending.is_set():
                return
            if status in _FINAL:
                raise failure_of(item.host, status, tail)
            if time.monotonic() - started_s > _SETTLED_S:
                retry_s = _RETRY_S
            self._options.write(
                f"{item.label} | ended with exit code {status}; starting again in {retry_s:g} s"
            )
            await self._pause(retry_s)
            retry_s = min(_LONGEST_RETRY_S, retry_s * 2.0)

    async def _run_once(
        self, item: RemoteProcess, connection: asyncssh.SSHClientConnection
    ) -> tuple[int, str]:
        """Run a process to its end; return its exit code and the last lines of its output.

        Raises HostError, asyncssh.Error.
        """
        tail: list[str] = []
        loggers = process_loggers(item.process.name.value, item.nodes)

        def show(text: str) -> None:
            tail[:] = [*tail[-9:], text]
            level, logger, message = attribute_line(text, loggers, is_error=False)
            # The process that coordinates reports what the others say about states as well.
            if level is not LogLevel.INFO or not message.startswith(_OF_COMPOSER):
                self._options.write(f"{item.label} | {text}")
                self._options.log(item, level, logger, message)

        run = ("-m", "composer", "run", self._options.system, *self._options.start)
        words = (*run, "--process", item.process.name.value)
        command = python_command(item.host, words, os.environ, SILENCE_S)
        try:
            process = await connection.create_process(
                command, encoding=None, stderr=asyncssh.STDOUT
            )
        except asyncssh.ChannelOpenError as error:
            if connection.is_closed():
                raise
            raise HostError(
                item.host, "its ssh server refuses another session", _SESSIONS
            ) from error
        beat = asyncio.create_task(self._beat(process))
        lines = OutputLines(show)
        try:
            while data := await process.stdout.read(65536):
                lines.add(data, time.monotonic())
            lines.finish()
            await process.wait_closed()
        finally:
            beat.cancel()
        status = process.exit_status
        if status is None:
            raise asyncssh.ConnectionLost("the channel was closed")
        return status, "\n".join(tail)

    async def _beat(self, process: asyncssh.SSHClientProcess[bytes]) -> None:
        """Say to the guard that this program is there, until it ends everything."""
        with suppress(OSError, asyncssh.Error):
            while not self._is_down.is_set():
                process.stdin.write(b".")
                with suppress(TimeoutError):
                    await asyncio.wait_for(self._is_down.wait(), _BEAT_S)
            process.stdin.write_eof()

    async def _pause(self, seconds: float) -> None:
        with suppress(TimeoutError):
            await asyncio.wait_for(self._is_ending.wait(), seconds)
